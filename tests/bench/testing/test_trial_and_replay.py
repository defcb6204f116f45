"""Laws of trial, gateway, recording and replay on the bus of a test."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import slipbench
from slipbench import dbc
from slipbench.bench.replay.edits import Alter, Delay, Drop
from slipbench.bench.testing.bench_bus import SignalTimeoutError
from slipbench.bench.testing.plugin import OPTIONS
from slipbench.bench.testing.setup import Choice, Setup
from slipbench.bench.trials.preparation import prepare
from slipbench.bench.trials.run import run_trial
from slipbench.protocol.codec.messages import Phase, TripReason
from slipbench.protocol.logs import read_log
from slipbench.protocol.recording.run_folder import FRAMES
from tests.paths import TRIALS, with_full_paths

OPTIONS_OF = {name: default for name, default, _ in OPTIONS}


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A throttle sweep of one second."""
    text = with_full_paths((TRIALS / "throttle_sweep.toml").read_text(encoding="utf-8"))
    for old, new in (
        ('duration = "30 s"', 'duration = "1 s"'),
        ('start = "0.5 Hz"', 'start = "2 Hz"'),
        ('stop = "12 Hz"', 'stop = "5 Hz"'),
        ('steady_for = "500 ms"', 'steady_for = "100 ms"'),
        ("[operating_point]", 'settling = "100 ms"\nhand_back = "100 ms"\n\n[operating_point]'),
    ):
        assert old in text
        text = text.replace(old, new)
    path = tmp_path_factory.mktemp("trial") / "short.toml"
    path.write_text(text, encoding="utf-8")
    return path


Make = Callable[[], Setup]


@pytest.fixture
def make(short: Path, tmp_path: Path) -> Iterator[Make]:
    """Make benches on the simulated clock, with the short trial."""
    made: list[Setup] = []

    def one() -> Setup:
        folder = tmp_path / f"bench{len(made)}"
        folder.mkdir()
        choice = Choice.of({**OPTIONS_OF, "slipbench-trial": str(short)})
        made.append(Setup(choice, folder, "test"))
        return made[-1]

    yield one
    for each in made:
        each.close()


@pytest.fixture(scope="module")
def drive(short: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The recording of the short trial, by the command's own way."""
    folder = tmp_path_factory.mktemp("runs") / "drive"
    outcome = run_trial(prepare(short, dbc.MOTORBIKE), folder, None)
    assert outcome.done
    return folder


def test_a_trial_on_the_bus_of_a_test_is_the_trial_of_the_command(make: Make, drive: Path) -> None:
    bench = make()
    bench.vehicle  # noqa: B018
    outcome = bench.trial.run()
    assert outcome.done
    ours, theirs = (read_log(each / FRAMES).frames for each in (bench.trial.folder, drive))
    assert np.array_equal(ours.data, theirs.data)
    assert np.array_equal(ours.time_ns, theirs.time_ns)
    assert slipbench.read(bench.trial.folder).description["outcome"]["valid"]


def test_a_lost_status_trips_the_trial_and_is_a_requirement_to_test(make: Make) -> None:
    bench = make()
    bench.vehicle  # noqa: B018
    trial = bench.trial
    excited = trial.wait_for("exciting", within="2 s")
    bench.stimulus.drop("EngineStatus", "100 ms", to="gateway")
    tripped = trial.wait_for("tripped", within="200 ms")
    assert tripped - excited < 0.1
    assert trial.gateway.state.trip is not None
    assert trial.gateway.state.trip.reason == TripReason.STALE
    back = bench.stimulus.wait_for("EcuStatus.authority == 0", within="25 ms")
    assert back - tripped < 0.025
    assert trial.run().state.phase == Phase.TRIPPED
    with pytest.raises(
        SignalTimeoutError, match=r"tripped at .* s, not done: EngineStatus: silent"
    ):
        trial.wait_for("done", within="1 s")


def test_the_recording_of_a_bus_is_a_run_folder(make: Make) -> None:
    bench = make()
    bench.vehicle  # noqa: B018
    bench.bus.run("500 ms")
    recording = bench.recording.read()
    assert recording.frame_count == bench.recording.frame_count
    times, speed = bench.bus.trace("EngineStatus.engine_speed", unit="rad/s")
    channel = recording.channels["engine_speed"]
    assert channel.value == pytest.approx(speed)
    decoded = bench.recording.decode()["EngineStatus.engine_speed"]
    assert decoded.time - decoded.time[0] == pytest.approx(times - times[0], abs=2e-6)


def test_a_replayed_drive_fires_triggers_and_reaches_other_nodes(make: Make, drive: Path) -> None:
    bench = make()
    fired: list[float] = []
    trigger = bench.stimulus.when("EcuStatus.authority == 1")
    trigger.call(lambda: fired.append(bench.bus.now)).drop("EngineStatus", "50 ms")
    result = bench.replay.run(drive)
    log = read_log(drive / FRAMES).frames
    assert result.sent == len(log) == bench.recording.frame_count + _lost(bench)
    authority = slipbench.decode(drive / FRAMES, dbc.MOTORBIKE)["EcuStatus.authority"]
    granted = float(authority.time[np.flatnonzero(authority.value == 1)[0]])
    assert fired == [pytest.approx(granted, abs=2e-3)]


def _lost(bench: Setup) -> int:
    faults = bench.bus.faults("EngineStatus")
    assert [fault for _, fault in faults] == ["lost"]
    times = bench.bus.times("EngineStatus")
    gap = float(np.diff(times).max())
    assert gap == pytest.approx(0.055, abs=2e-3)
    return round(gap / 0.005) - 1


# Edits


def test_a_dropped_message_is_missing_and_its_counter_shows_it_unless_it_is_repaired(
    make: Make, drive: Path
) -> None:
    for repair, seen in ((False, ["lost"]), (True, [])):
        bench = make()
        bench.replay.run(drive, [Drop("OpticalSpeed", 0.3, 0.4, repair)])
        times = bench.bus.times("OpticalSpeed")
        assert not np.any((times > 0.305) & (times < 0.395))
        assert [fault for _, fault in bench.bus.faults("OpticalSpeed")] == seen


def test_a_repaired_drop_hides_no_other_loss(make: Make, drive: Path) -> None:
    bench = make()
    bench.replay.run(
        drive, [Drop("OpticalSpeed", 0.1, 0.15), Drop("OpticalSpeed", 0.3, 0.4, repair=True)]
    )
    assert [fault for _, fault in bench.bus.faults("OpticalSpeed")] == ["lost"]


def test_a_delayed_message_comes_later_by_that_time_and_nothing_else_moves(
    make: Make, drive: Path
) -> None:
    plain, delayed = make(), make()
    plain.replay.run(drive)
    delayed.replay.run(drive, [Delay("EngineStatus", 0.020)])
    before, after = (each.bus.times("EngineStatus") for each in (plain, delayed))
    assert after - before == pytest.approx(0.020, abs=5e-4)
    others = [each.bus.times("OpticalSpeed") for each in (plain, delayed)]
    assert others[1] == pytest.approx(others[0], abs=5e-4)


def test_an_altered_signal_has_its_value_and_a_correct_crc(make: Make, drive: Path) -> None:
    plain, altered, damaged = make(), make(), make()
    name = "EngineStatus.engine_speed"
    plain.replay.run(drive)
    altered.replay.run(drive, [Alter(name, lambda time, rpm: rpm + 100 * time, begin=0.5)])
    damaged.replay.run(drive, [Alter(name, 9000, 0.5, 0.6, repair=False)])
    (times, before), (_, after) = (each.bus.trace(name) for each in (plain, altered))
    expected = before + np.where(times > 0.5, 100 * times, 0)
    assert after == pytest.approx(expected, abs=0.5)
    assert altered.bus.faults("EngineStatus") == []
    assert {fault for _, fault in damaged.bus.faults("EngineStatus")} >= {"wrong CRC"}


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (Drop("Optical"), "no message 'Optical'"),
        (Alter("EngineStatus.speed", 1), "no signal 'speed'"),
        (Alter("EngineStatus.gear", 99), "cannot carry 99"),
        (Alter("EngineStatus.gear", float("nan")), "cannot carry nan"),
        (Delay("EngineStatus", 0.1, begin=1e6), "concerns no frame of the log"),
    ],
)
def test_an_edit_that_does_not_suit_the_log_is_named(
    make: Make, drive: Path, edit, said: str
) -> None:
    bench = make()
    with pytest.raises(slipbench.InputError, match=said):
        bench.replay.run(drive, [edit])
    assert bench.recording.frame_count == 0

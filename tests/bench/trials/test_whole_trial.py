"""Whole trials over simulated CAN: what is on the bus, and what stays true whatever happens."""

from pathlib import Path

import can
import numpy as np
import pytest

from slipbench import dbc
from slipbench.bench.bus.simulated_bus import SimulatedNode
from slipbench.bench.loop.recorder import open_log
from slipbench.bench.safety.trial import Plan
from slipbench.bench.trials.preparation import Prepared
from slipbench.bench.trials.run import run_trial
from slipbench.bench.trials.simulated_trial import run_simulated
from slipbench.bench.vehicle.devices import Grant
from slipbench.bench.vehicle.virtual_motorcycle import Scenario, VirtualMotorcycle, read_vehicle
from slipbench.protocol.binding.binding import own_binding
from slipbench.protocol.codec.codec import Codec, Sender
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    EcuStatus,
    Phase,
    RiderControls,
    TrialStatus,
    TripReason,
)
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import read_log
from slipbench.protocol.recording.run_folder import read, write_description
from tests.bench.conditions import plan
from tests.bench.lockstep import LockStep
from tests.paths import DEMONSTRATION, TRIALS

VEHICLE = DEMONSTRATION


def prepared(**changes) -> Prepared:
    the_plan: Plan = plan(
        **{"rider__presses_button_after": "100 ms", "settling": "200 ms", **changes}
    )
    return Prepared(
        the_plan,
        Scenario(read_vehicle(VEHICLE), the_plan.trial),
        own_binding(load_database(dbc.MOTORBIKE)),
        TRIALS / "throttle_sweep.toml",
        VEHICLE,
        dbc.MOTORBIKE,
    )


@pytest.fixture(scope="module")
def by_the_book(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "sweep"
    outcome = run_trial(prepared(), folder, None)
    return folder, outcome


def commands(folder: Path) -> list[tuple[float, ActuatorCommand]]:
    """Every command on the bus, with its time in s."""
    return [(t, m) for t, m in messages(folder) if isinstance(m, ActuatorCommand)]


def messages(folder: Path):
    log, codec = read_log(folder / "frames.log").frames, Codec(load_database(dbc.MOTORBIKE))
    for index in range(len(log)):
        data = log.data[index, : log.length[index]].tobytes()
        yield log.time_ns[index] * 1e-9, codec.decode(int(log.identifier[index]), data)


def test_a_trial_by_the_book_ends_done_with_every_tick_accounted_for(by_the_book):
    _, outcome = by_the_book
    assert outcome.done
    assert outcome.trip == ""
    assert outcome.lateness.skipped == 0
    phases = [change.phase for change in outcome.changes]
    assert phases == [Phase.ARMED, Phase.EXCITING, Phase.SETTLING, Phase.HANDING_BACK, Phase.DONE]


def test_no_command_carries_authority_before_the_button_or_after_the_end(by_the_book):
    folder, outcome = by_the_book
    entered = {change.phase: change.time_ns * 1e-9 for change in outcome.changes}
    for time, command in commands(folder):
        held = entered[Phase.EXCITING] <= time < entered[Phase.DONE]
        assert held or command.authority == Authority.NONE


def test_the_first_command_with_authority_comes_within_a_tick_of_the_button(tmp_path):
    """From the end of the frame that tells of the button to the frame that takes authority.

    The gateway hears a frame at its next tick, and commands in that same tick: a period at the
    most, and then its frame, at most 0.2 ms with those that are on the bus before it.
    """
    for milliseconds in (50, 51, 57, 93):
        folder = tmp_path / str(milliseconds)
        changes = {
            "rider__presses_button_after": f"{milliseconds} ms",
            "excitation__duration": "200 ms",
            "excitation__start": "2 Hz",
        }
        run_trial(prepared(**changes), folder, None)
        told = list(messages(folder))
        pressed = next(t for t, m in told if isinstance(m, RiderControls) and m.button)
        began = next(
            t for t, m in told if isinstance(m, ActuatorCommand) and m.authority != Authority.NONE
        )
        assert 0 < began - pressed <= 1.2e-3


def test_the_recording_reads_back_with_every_role_and_no_fault(by_the_book):
    folder, _ = by_the_book
    recording = read(folder)
    assert recording.missing == {}
    assert recording.faults == ()
    assert recording.trial is not None
    assert {"throttle_command", "throttle_position", "rear_teeth", "optical_speed"} <= set(
        recording.channels
    )


def test_the_ecu_echoes_the_waveform_that_was_planned(by_the_book):
    folder, outcome = by_the_book
    echo = read(folder).channels["throttle_command"]
    entered = {change.phase: change.time_ns * 1e-9 for change in outcome.changes}
    assert echo.arrival is not None
    began = entered[Phase.EXCITING] - 1.0  # the recording starts a second into the epoch
    inside = (echo.arrival > began) & (echo.arrival < began + 2.0)
    planned = plan().excitation.table + outcome.state.throttle
    lag = round(float(np.argmax(np.correlate(echo.value[inside] - 0.09, planned - 0.09, "full"))))
    assert lag - (planned.size - 1) in (0, 1, 2, 3)
    assert np.ptp(echo.value[inside]) == pytest.approx(np.ptp(planned), abs=2e-4)


def test_the_same_trial_gives_the_same_frames_to_the_last_bit(by_the_book, tmp_path):
    folder, _ = by_the_book
    run_simulated(prepared(), tmp_path)
    assert (tmp_path / "frames.log").read_bytes() == (folder / "frames.log").read_bytes()
    assert (tmp_path / "ticks.csv").read_bytes() == (folder / "ticks.csv").read_bytes()


def test_another_seed_gives_other_disturbances(by_the_book, tmp_path):
    folder, _ = by_the_book
    run_simulated(prepared(seed=2), tmp_path)
    assert (tmp_path / "frames.log").read_bytes() != (folder / "frames.log").read_bytes()


def test_letting_go_of_the_button_hands_back_within_two_milliseconds(tmp_path):
    outcome = run_trial(prepared(rider__holds_button_for="500 ms"), tmp_path / "run", None)
    assert outcome.state.trip is not None
    assert outcome.state.trip.reason == TripReason.BUTTON_RELEASED
    tripped = next(c.time_ns for c in outcome.changes if c.phase == Phase.TRIPPED) * 1e-9
    late = [t for t, c in commands(tmp_path / "run") if c.authority and t > tripped + 1e-9]
    assert late == []
    shown = [m for t, m in messages(tmp_path / "run") if isinstance(m, TrialStatus) and t > tripped]
    assert {status.trip for status in shown} == {TripReason.BUTTON_RELEASED}


@pytest.mark.parametrize(
    ("limits", "reason"),
    [
        ({"limits__slip": "1.3 %"}, TripReason.SLIP),
        ({"limits__engine_speed": ["13990 rpm", "14010 rpm"]}, TripReason.ENGINE_SPEED),
        ({"limits__speed": ["30 m/s", "52 m/s"]}, TripReason.SPEED),
        ({"limits__distance": "20 m"}, TripReason.DISTANCE),
    ],
)
def test_a_motorcycle_that_leaves_the_limits_gets_the_rider_back(tmp_path, limits, reason):
    outcome = run_trial(prepared(**limits), tmp_path / "run", None)
    assert outcome.state.trip is not None
    assert outcome.state.trip.reason == reason
    _, last = commands(tmp_path / "run")[-1]
    assert last.authority == Authority.NONE


def test_an_amplitude_that_would_leave_the_range_is_refused_before_anything_moves(tmp_path):
    changes = {"limits__throttle": ["8 %", "30 %"]}
    with pytest.raises(InputError, match="leave the throttle's range"):
        run_trial(prepared(**changes), tmp_path / "run", None)


def test_an_existing_folder_is_never_written_into(by_the_book):
    folder, _ = by_the_book
    before = sorted((p.name, p.stat().st_mtime_ns) for p in folder.iterdir())
    with pytest.raises(InputError, match="never overwritten"):
        run_trial(prepared(), folder, None)
    assert sorted((p.name, p.stat().st_mtime_ns) for p in folder.iterdir()) == before


def test_a_motorcycle_that_never_gets_there_is_told_why(tmp_path):
    never = prepared(operating_point__engine_speed_window="0.1 rpm", ready_within="300 ms")
    outcome = run_trial(never, tmp_path / "run", None)
    assert outcome.state.trip is not None
    assert outcome.state.trip.reason == TripReason.NEVER_READY
    assert "14000 +- 0 rpm" in outcome.trip


def test_silence_of_the_bench_gives_the_rider_the_throttle_back():
    """The devices protect the rider on their own: here the bench stops sending altogether."""
    with LockStep(prepared().scenario) as world:
        sender = Sender(world.codec)
        for number in range(200):
            if number < 100:
                command = ActuatorCommand(Authority.THROTTLE, 0.1, 0.0, number / 1e3)
                world.send(*sender.encode(command))
            world.live()
        statuses = [(t, m) for t, m in world.heard() if isinstance(m, EcuStatus)]
    last_held = max(t for t, status in statuses if status.authority == Authority.THROTTLE)
    assert 0.1 <= last_held <= 0.1 + 0.025
    assert len(world.motorcycle.watchdog_timeouts) == 1


def test_after_a_silence_the_bench_must_release_before_it_may_hold_again():
    asks = ActuatorCommand(Authority.THROTTLE, 0.1, 0.0, 0.0)
    released = ActuatorCommand(Authority.NONE, 0.0, 0.0, 0.0)
    grant = Grant().receive(asks, 1.0)
    assert grant.with_watchdog(1.019, 0.02).authority == Authority.THROTTLE
    silent = grant.with_watchdog(1.0201, 0.02)
    assert silent.authority == Authority.NONE
    assert silent.receive(asks, 1.03).authority == Authority.NONE
    assert silent.receive(released, 1.03).receive(asks, 1.031).authority == Authority.THROTTLE


def test_two_vehicles_on_one_bus_are_found_out(tmp_path, monkeypatch):
    monkeypatch.setattr("slipbench.bench.trials.simulated_trial.VirtualMotorcycle", Twins)
    outcome = run_trial(prepared(), tmp_path / "run", None)
    assert outcome.state.trip is not None
    assert outcome.state.trip.reason == TripReason.TWO_SENDERS
    assert all(command.authority == Authority.NONE for _, command in commands(tmp_path / "run"))


class Twins(VirtualMotorcycle):
    """Two motorcycles behind one connection: each frame goes out twice."""

    def _send(self, frame):
        super()._send(frame)
        super()._send(frame)


class FillingDisk:
    """A log on a disk that fills up in the middle of the excitation."""

    def __init__(self, log):
        self._log, self._room = log, 400_000

    def write(self, data):
        self._room -= len(data)
        if self._room < 0:
            raise OSError(28, "No space left on device")
        return self._log.write(data)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._log.close()


def test_a_full_disk_hands_back_and_leaves_what_was_written_readable(tmp_path, monkeypatch):
    monkeypatch.setattr(
        "slipbench.bench.trials.simulated_trial.open_log", lambda path: FillingDisk(open_log(path))
    )
    outcome = run_trial(prepared(), tmp_path / "run", None)
    assert outcome.state.trip is not None
    assert outcome.state.trip.reason == TripReason.RECORDER
    assert outcome.excited
    assert outcome.notes == ("the recorder could not write: No space left on device",)
    recording = read(tmp_path / "run")
    assert recording.duration > 1.5


def test_a_disk_without_room_for_anything_is_told_before_the_trial_and_left_as_it_was(
    tmp_path, monkeypatch
):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("slipbench.bench.trials.run.write_description", full)
    with pytest.raises(InputError, match=r"cannot be begun\n  found: No space left on device"):
        run_trial(prepared(), tmp_path / "run", None)
    assert not (tmp_path / "run").exists()


def test_a_place_where_no_folder_can_be_is_told_as_that(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be made"):
        run_trial(prepared(), tmp_path / "file" / "run", None)


def test_a_disk_without_room_for_the_description_keeps_the_frames(tmp_path, monkeypatch):
    def full(folder, description):
        if "outcome" in description:
            raise OSError(28, "No space left on device")
        write_description(folder, description)

    monkeypatch.setattr("slipbench.bench.trials.run.write_description", full)
    outcome = run_trial(prepared(), tmp_path / "run", None)
    assert outcome.notes == ("run.toml has no outcome of the trial: No space left on device",)
    assert read(tmp_path / "run").frame_count > 10_000


def test_the_gateway_goes_on_releasing_while_the_bus_refuses_frames(tmp_path, monkeypatch):
    """A controller that is off the bus refuses to send: the trial trips and the loop lives on."""
    monkeypatch.setattr("slipbench.bench.bus.simulated_bus.SimulatedNode.send", refusing_after(2.2))
    outcome = run_trial(prepared(), tmp_path / "run", None)
    assert outcome.state.trip is not None
    assert outcome.state.trip.reason == TripReason.BUS_OFF
    assert outcome.notes[0] == "bus off"


def refusing_after(seconds):
    """The bus of the gateway refuses every frame from `seconds` into the epoch on."""
    accept = SimulatedNode.send

    def send(node, message, timeout=None):
        if "gateway" in node.channel_info and node._wire.now_ns > seconds * 1e9:
            raise can.CanOperationError("bus off")
        accept(node, message, timeout)

    return send

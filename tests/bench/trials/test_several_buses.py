"""Whole trials whose messages lie on two buses, with one gateway, on the simulated clock."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import can
import numpy as np
import pytest

from slipbench.bench.bus.faults import FaultPlan, Lost, Where
from slipbench.bench.bus.simulated_bus import SimulatedNode
from slipbench.bench.safety.trial import ENDED
from slipbench.bench.trials.outcome import Outcome
from slipbench.bench.trials.preparation import Prepared, prepare
from slipbench.bench.trials.simulated_trial import run_simulated, simulated_trial
from slipbench.protocol.codec.codec import Sender
from slipbench.protocol.codec.messages import ActuatorCommand, Authority, EcuStatus, Phase
from slipbench.protocol.logs import read_log
from slipbench.protocol.recording.run_folder import read as read_run
from tests.bench.trials.test_foreign_trials import KEPT, SEED, SHORT, Ride, commands, ridden, trial
from tests.protocol.binding.foreign import foreign, foreign_binding

BUSES = ("powertrain", "chassis")
BREAKS = 0.7  # s of the fault, from the trial's start
BEGINS = 1_700_000_000  # ns, the same on the clock of the recording


@cache
def whole(*buses: str) -> Ride:
    """A short trial on a drawn database that is split over these buses; none: one without a name."""
    folder = Path(KEPT.name) / "-".join(("whole", *buses))
    folder.mkdir()
    return ridden(folder, foreign(SEED, buses).write(folder / "bus"))


def bus_of_each(prepared: Prepared) -> dict[int, str]:
    return {each.identifier: each.bus for each in prepared.database.messages}


def short(folder: Path, seed: int) -> Prepared:
    return prepare(
        trial(folder, "throttle_sweep", SHORT, {}), None, foreign(seed, BUSES).write(folder / "bus")
    )


def split_with(message: str, number: int, folder: Path) -> Prepared:
    """A drawn split in which a message of the bench lies on the bus of this number."""
    for seed in range(20):
        codec = foreign_binding(seed, folder / "looked at", BUSES).codec()
        if codec.plan_of(codec.carriers(message)[0]).message.bus == codec.buses[number]:
            return short(folder, seed)
    raise AssertionError("each of 20 seeds has it on the other bus")


def test_a_sweep_on_two_buses_is_that_on_one():
    ride, one = whole(*BUSES), whole()
    assert ride.outcome.done, ride.outcome.trip
    assert ride.outcome.notes == ()
    assert sorted(ride.prepared.binding.buses) == sorted(BUSES)
    assert [(c.phase, c.time_ns) for c in ride.outcome.changes] == [
        (c.phase, c.time_ns) for c in one.outcome.changes
    ]
    sent = [c for _, c in commands(ride)]
    assert [c.authority for c in sent] == [c.authority for _, c in commands(one)]
    opening = np.array([[c.throttle for c in sent], [c.throttle for _, c in commands(one)]])
    assert np.ptp(opening[0]) > 0.01
    assert np.abs(opening[1] - opening[0]).max() < 1e-3


def test_every_frame_is_recorded_on_the_bus_of_its_message_and_none_leaves_on_another():
    ride = whole(*BUSES)
    buses = bus_of_each(ride.prepared)
    log = read_log(ride.folder / "frames.log")
    recorded = {
        (int(identifier), log.frames.buses[bus])
        for identifier, bus in zip(log.frames.identifier, log.frames.bus, strict=True)
    }
    assert recorded == {(identifier, buses[identifier]) for identifier, _ in recorded}
    assert set(log.frames.buses) == set(BUSES)
    assert log.warnings == ()


def test_the_description_names_the_buses():
    description = read_run(whole(*BUSES).folder).description
    assert set(description["buses"]) == set(BUSES)
    assert description["bus"]["interface"] == "simulated"
    assert read_run(whole().folder).description["bus"]["name"] == "can0"
    assert set(read_run(whole(*BUSES).folder).bus_load) == set(BUSES)


def test_frames_of_the_same_identifier_on_the_other_bus_are_read_as_no_role(tmp_path):
    """Each frame is repeated half a second later on the other bus, intact."""
    ride = whole(*BUSES)
    log = read_log(ride.folder / "frames.log").frames
    copies = tmp_path / "run"
    copies.mkdir()
    for path in ride.folder.iterdir():
        (copies / path.name).write_bytes(path.read_bytes())
    other = dict(zip(log.buses, reversed(log.buses), strict=True))
    lines = (ride.folder / "frames.log").read_text().splitlines()
    late = []
    for line in lines:
        stamp, bus, frame, direction = line.split()
        late.append(f"({float(stamp[1:-1]) + 0.5:017.6f}) {other[bus]} {frame} {direction}")
    both = sorted([*lines, *late], key=lambda line: line.split()[0])
    (copies / "frames.log").write_text("\n".join([*both, ""]))
    read, again = read_run(ride.folder), read_run(copies)
    assert again.frame_count == 2 * read.frame_count
    assert again.missing == read.missing == {}
    assert read.channels.keys() == again.channels.keys()
    for role, channel in read.channels.items():
        if role != "trial_phase":  # lasts to the last frame
            np.testing.assert_array_equal(channel.value, again.channels[role].value)
            np.testing.assert_array_equal(channel.time, again.channels[role].time)


Device = Callable[[SimulatedNode], Callable[[int], None]]


def repeating(prepared: Prepared, message: object) -> Device:
    """A device that sends a valid message of another sender every 5 ms, under counters of its own."""
    sender = Sender(prepared.binding.codec())

    def connect(node: SimulatedNode) -> Callable[[int], None]:
        def run(due: int) -> None:
            if due < BEGINS or due // 1_000_000 % 5:
                return
            for identifier, data, extended, _ in sender.frames(message):
                node.send(
                    can.Message(arbitration_id=identifier, data=data, is_extended_id=extended)
                )

        return run

    return connect


def with_another(prepared: Prepared, message: object, folder: Path) -> Outcome:
    """Outcome of a trial with a second sender on the first bus."""
    folder.mkdir()
    devices = {"other": repeating(prepared, message)}
    with simulated_trial(prepared, devices=devices) as made:
        return made.run(folder)


OTHERS = {
    "ActuatorCommand": ActuatorCommand(Authority.THROTTLE, 0.9, 0.0, 0.0),
    "EcuStatus": EcuStatus(Authority.NONE, 0.9, 0.0, 0.0),
}


@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.parametrize("number", [0, 1])
def test_another_sender_counts_on_the_bus_of_the_message_only(name, number, tmp_path):
    """The other sender is on bus 0; the message lies on bus `number`."""
    outcome = with_another(split_with(name, number, tmp_path), OTHERS[name], tmp_path / "run")
    if number:
        assert outcome.done, outcome.trip
        assert outcome.notes == ()
    else:
        found = (outcome.trip, *outcome.notes)  # the gateway finds it, or the virtual motorcycle
        assert not outcome.done
        assert any("another bench sends" in text or "another device" in text for text in found)


@pytest.mark.parametrize("bus", BUSES)
@pytest.mark.parametrize("seed", range(3))
def test_a_bus_that_falls_silent_ends_the_trial(bus, seed, tmp_path):
    """In whichever way roles are split: within the limit of age, plus the period of the messages."""
    prepared = short(tmp_path, seed)
    silent = frozenset(k for k, on in bus_of_each(prepared).items() if on == bus)
    (tmp_path / "run").mkdir()
    plan = FaultPlan((Lost(1.0, Where(begin=BREAKS, identifiers=silent)),))
    outcome = run_simulated(prepared, tmp_path / "run", faults=plan)
    assert outcome.state.phase in ENDED
    assert not outcome.done
    (tripped,) = [c.time_ns for c in outcome.changes if c.phase is Phase.TRIPPED]
    assert 0 < tripped * 1e-9 - 1.0 - BREAKS < 0.050

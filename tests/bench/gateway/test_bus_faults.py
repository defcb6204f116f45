"""Trials on a bus that fails: who notices, what is handed back, what stays in the record."""

import can
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.bench.bus.counters import Counters
from slipbench.bench.bus.error_frames import error_content
from slipbench.bench.bus.events import Cause
from slipbench.bench.bus.faults import (
    Corrupted,
    Disturbed,
    Duplicated,
    FaultPlan,
    Frozen,
    Lost,
    Where,
)
from slipbench.bench.bus.simulated_bus import SimulatedBus, SimulatedNode
from slipbench.bench.gateway.controller_state import ControllerState
from slipbench.bench.gateway.gateway_bus import OFF_THE_BUS
from slipbench.bench.loop.ticks import read_ticks
from slipbench.bench.trials.outcome import Outcome
from slipbench.bench.trials.simulated_trial import run_simulated
from slipbench.bench.vehicle.virtual_motorcycle import VirtualMotorcycle
from slipbench.protocol.codec.messages import Phase, TripReason
from slipbench.protocol.logs import read_log
from tests.bench.trials.test_whole_trial import commands, prepared

START = 1.0  # s, of the recording's clock
BREAKS = 1.5  # s into the trial, in the midst of the excitation
SILENCE = 0.020  # s after which the devices hand back by themselves
COMMAND = 0x10  # its identifier


def ridden(tmp_path, *faults) -> Outcome:
    return run_simulated(prepared(), tmp_path, faults=FaultPlan(faults))


def test_a_gateway_that_is_driven_off_the_bus_trips_for_that_and_the_rider_has_the_throttle(
    tmp_path, monkeypatch
):
    motorcycles = []
    monkeypatch.setattr(
        "slipbench.bench.trials.simulated_trial.VirtualMotorcycle",
        lambda *things: motorcycles.append(VirtualMotorcycle(*things)) or motorcycles[-1],
    )
    outcome = ridden(tmp_path, Disturbed(1.0, Where(BREAKS, senders={"gateway"})))
    assert outcome.state.trip is not None
    assert outcome.state.trip.reason == TripReason.BUS_OFF
    tripped = next(c.time_ns for c in outcome.changes if c.phase == Phase.TRIPPED) * 1e-9 - START
    assert tripped - BREAKS < 0.010  # 32 attempts on the wire, and a tick
    assert len(motorcycles[0].watchdog_timeouts) == 1  # it heard no release: its own silence did it
    assert motorcycles[0].watchdog_timeouts[0] < BREAKS + SILENCE + 0.003


def test_error_frames_are_in_the_record_as_such_and_as_nothing_else(tmp_path):
    ridden(tmp_path, Disturbed(1.0, Where(BREAKS, senders={"gateway"})))
    assert dict(read_log(tmp_path / "frames.log").frames.skipped) == {"error frames": 32}
    frames = [line.split()[2] for line in (tmp_path / "frames.log").read_text().splitlines()]
    errors = [frame for frame in frames if len(frame.partition("#")[0]) == 8]
    assert len(errors) == 32
    assert all(int(frame.partition("#")[0], 16) & 0x20000000 for frame in errors)


@settings(max_examples=3, deadline=None)
@given(st.sets(st.integers(0, 1000), max_size=12), st.integers(1, OFF_THE_BUS - 1))
def test_every_command_that_a_full_queue_refuses_is_a_tick_that_says_so(
    tmp_path_factory, begin, in_a_row
):
    """Commands in the record and ticks in the table add up; a queue full for a moment trips not."""
    folder, offered = tmp_path_factory.mktemp("full"), []
    full = {OFF_THE_BUS * b + k for b in begin for k in range(in_a_row)}

    def send(node, message, timeout=None):
        if message.arbitration_id == COMMAND:
            offered.append(message)
            if len(offered) - 1 in full:
                raise can.CanOperationError("Transmit buffer full")
        taken(node, message, timeout)

    taken = SimulatedNode.send
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SimulatedNode, "send", send)
        outcome = run_simulated(prepared(), folder)
    ticks = read_ticks(folder / "ticks.csv", outcome.lateness.period)
    assert outcome.done
    expected = sorted(full.intersection(range(ticks.tick.size)))
    assert np.flatnonzero(ticks.refused).tolist() == expected
    log = read_log(folder / "frames.log").frames
    recorded = int(np.sum((log.identifier == COMMAND) & log.sent))
    on_the_wire = 1  # the last one, when the loop ends
    assert recorded + on_the_wire == ticks.tick.size - np.sum(ticks.refused)
    assert len(outcome.notes) == np.sum(ticks.refused)


def test_an_occasional_error_on_the_wire_costs_nothing(tmp_path):
    """CAN repeats what was destroyed: the trial is done, and no frame is missing or doubled."""
    outcome = ridden(tmp_path, Disturbed(0.01))
    assert outcome.done
    assert outcome.trip == ""


@pytest.mark.parametrize(
    ("fault", "reason", "within"),
    [
        (Lost(1.0, Where(BREAKS, receivers={"gateway"})), TripReason.STALE, 0.050),
        (Lost(1.0, Where(BREAKS, receivers={"motorcycle"})), TripReason.AUTHORITY_LOST, 0.050),
        (Corrupted(1.0, Where(BREAKS, receivers={"gateway"})), TripReason.FAULTY, 0.050),
        (Frozen(Where(BREAKS, receivers={"gateway"})), TripReason.FAULTY, 0.050),
        (Duplicated(1.0, Where(BREAKS, receivers={"gateway"})), TripReason.TWO_SENDERS, 0.5),
    ],
    ids=["lost to us", "lost to it", "corrupted", "frozen", "duplicated"],
)
def test_what_breaks_the_dialogue_trips_and_releases(tmp_path, fault, reason, within):
    """Duplicates tell the truth twice: that is found out, and not within milliseconds."""
    outcome = ridden(tmp_path, fault)
    assert outcome.state.trip is not None
    assert outcome.state.trip.reason == reason
    tripped = next(c.time_ns for c in outcome.changes if c.phase == Phase.TRIPPED) * 1e-9
    assert tripped - START - BREAKS < within
    held = [time for time, command in commands(tmp_path) if command.authority and time > tripped]
    assert held == []


# The controller's own state


def heard(bus: can.BusABC, *identifiers_and_details: tuple[int, bytes]) -> ControllerState:
    state = ControllerState(bus)
    for identifier, data in identifiers_and_details:
        state.error_frame(
            can.Message(
                arbitration_id=identifier, data=data, is_error_frame=True, is_extended_id=False
            )
        )
    return state


class Mute(can.BusABC):
    """A bus that answers nothing about its controller. It imitates no wire."""

    def __init__(self):
        super().__init__(channel="mute")

    def send(self, msg, timeout=None):
        raise AssertionError


@pytest.fixture
def mute():
    with Mute() as bus:
        yield bus


OFF = error_content(Cause.BIT, Counters(256, 0), True)
BACK = error_content(Cause.RESTARTED, Counters(), False)


def test_bus_off_is_heard_from_the_error_frame_and_over_with_the_restart(mute):
    assert not heard(mute).off()
    assert heard(mute, OFF).off()
    back = heard(mute, OFF, BACK)
    assert back.off()  # it was, since it was asked last
    assert not back.off()


@given(st.sampled_from(list(Cause)), st.integers(0, 255), st.integers(0, 128), st.booleans())
def test_no_error_short_of_bus_off_says_bus_off(cause, transmit, receive, sending):
    with Mute() as bus:
        assert not heard(bus, error_content(cause, Counters(transmit, receive), sending)).off()


def test_a_bus_that_answers_is_asked():
    wire = SimulatedBus(1_000_000, faults=FaultPlan((Disturbed(1.0),)))
    with wire.node("gateway") as ours, wire.node("other"):
        state = ControllerState(ours)
        assert not state.off()
        ours.send(can.Message(arbitration_id=1))
        wire.advance_to(1_000_000_000)
        assert state.off()


def test_a_bus_that_is_gone_is_a_bus_we_are_off(mute, monkeypatch):
    def gone(_bus):
        raise can.CanOperationError("gone")

    monkeypatch.setattr(Mute, "state", property(gone))
    assert ControllerState(mute).off()


def test_a_bus_that_cannot_say_is_not_asked_again(mute, monkeypatch):
    asked = []

    def unknown(_bus):
        asked.append(1)
        raise NotImplementedError

    monkeypatch.setattr(Mute, "state", property(unknown))
    state = ControllerState(mute)
    assert not state.off()
    assert not state.off()
    assert asked == [1]

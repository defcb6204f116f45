"""Laws of one tick of the gateway: what it records, reports, hears in time, and when it ends."""

import math
from dataclasses import replace
from itertools import pairwise

import can
import numpy as np
import pytest

from slipbench import dbc
from slipbench.bench.bus.error_frames import BUS_OFF as BUS_OFF_ERROR
from slipbench.bench.gateway.gateway import (
    AFTERWARDS,
    BEHIND,
    MOST_FRAMES,
    MOST_NOTES,
    STATUS_PERIOD,
    Gateway,
    PhaseChange,
)
from slipbench.bench.gateway.sender_monitor import cycles_of
from slipbench.bench.gateway.tx_echo import PATIENCE
from slipbench.bench.loop.clock import SECOND
from slipbench.bench.loop.ring import BIT_RATE_SWITCH, ERROR, EXTENDED, FD, REMOTE, SENT, Ring
from slipbench.bench.safety.trial import ENDED, HOLDING, not_ready
from slipbench.protocol.binding.binding import own_binding
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    Phase,
    RiderControls,
    TrialStatus,
    TripReason,
)
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Message
from tests.bench.safety.world import MILLISECOND, START, WHEELS, World, codec, plan

DATABASE = load_database(dbc.MOTORBIKE)
STATUS, COMMAND = (codec().identifier(name) for name in ("TrialStatus", "ActuatorCommand"))


class Deaf:
    """A bus that keeps what it is sent and echoes nothing of it."""

    state = can.BusState.ACTIVE

    def __init__(self, waiting=()) -> None:
        self.waiting, self.sent, self.fault = list(waiting), [], None

    def recv(self, timeout):
        if timeout != 0:
            pytest.fail("a tick waits for a frame")
        if self.fault:
            raise self.fault
        return self.waiting.pop(0) if self.waiting else None

    def send(self, message):
        if self.fault:
            raise self.fault
        self.sent.append(message)


def gateway(bus, ring=None, **options) -> Gateway:
    return Gateway(
        plan("throttle"), bus, own_binding(DATABASE), ring or Ring.local(64), WHEELS, **options
    )


def in_phase(phase: Phase, actuator: str = "throttle") -> World:
    """A world whose trial stands in `phase`; the rider presses once it has armed."""
    world = World(actuator)
    for _ in range(80):
        if world.gateway.state.phase == phase:
            return world
        if world.gateway.state.phase in (Phase.IDLE, Phase.ARMED):
            world.button = world.gateway.expects_the_button
        world.tick()
    pytest.fail(f"it never came to {phase.name}")


def sent(bus, identifier):
    return [codec().decode(identifier, m.data) for m in bus.sent if m.arbitration_id == identifier]


@pytest.mark.parametrize(
    ("kind", "flag"),
    [
        ({}, 0),
        ({"is_extended_id": True}, EXTENDED),
        ({"is_fd": True}, FD),
        ({"is_fd": True, "bitrate_switch": True}, FD | BIT_RATE_SWITCH),
        ({"is_remote_frame": True}, REMOTE),
        ({"is_error_frame": True}, ERROR),
    ],
)
def test_every_frame_is_recorded_as_what_it_is_at_the_time_of_its_stamp(kind, flag):
    data = b"" if kind.get("is_remote_frame") else b"\1\2\3"
    options = {"is_extended_id": False, **kind}
    frame = can.Message(arbitration_id=0x55, data=data, timestamp=7.25, **options)
    ring = Ring.local(8)
    for stamp, time_ns in ((None, 7_250_000_000), (lambda t: round(t * 4), 29)):
        own = gateway(Deaf([frame]), ring=ring, **({"stamps": (stamp,)} if stamp else {}))
        own.tick(1, START)
        (slot,) = ring.drain()
        assert (slot.time_ns, slot.identifier, slot.flags) == (time_ns, 0x55, flag)
        assert bytes(slot.data) == data


def test_frames_of_ours_are_recorded_as_sent_when_they_come_back():
    bus, ring = Deaf(), Ring.local(8)
    own = gateway(bus, ring=ring)
    own.tick(1, START)
    assert list(ring.drain()) == []
    bus.waiting = list(bus.sent)
    foreign = can.Message(arbitration_id=0x55, data=bus.sent[0].data, is_extended_id=False)
    bus.waiting.append(foreign)
    own.tick(2, START + MILLISECOND)
    assert [(slot.identifier, slot.flags) for slot in ring.drain()] == [
        (COMMAND, SENT),
        (STATUS, SENT),
        (0x55, 0),
    ]
    assert own.state.trip is None  # our own frames are nobody else's


def test_on_an_interface_without_echo_frames_are_recorded_when_they_are_handed_over():
    bus, ring = Deaf(), Ring.local(256)
    own = gateway(bus, ring=ring)
    tick = 0
    while len(bus.sent) < PATIENCE:
        tick += 1
        own.tick(tick, START + tick * MILLISECOND)
    tick += 1
    list(ring.drain())
    own.tick(tick, START + tick * MILLISECOND)
    (slot, *more) = ring.drain()
    assert (slot.identifier, slot.flags) == (COMMAND, SENT)
    assert slot.time_ns == pytest.approx(START + tick * MILLISECOND, abs=300)
    assert all(each.flags == SENT for each in more)


def test_a_ring_that_is_full_is_a_recorder_that_failed():
    frames = [can.Message(arbitration_id=0x55, is_extended_id=False) for _ in range(9)]
    own = gateway(Deaf(frames), ring=Ring.local(8))
    own.tick(1, START)
    assert own.state.trip.reason == TripReason.RECORDER


def test_a_status_is_sent_at_once_and_then_every_20_ms_with_the_number_of_its_tick():
    bus = Deaf()
    own = gateway(bus)
    at = []
    for number in range(1, 102):
        before = len(bus.sent)
        own.tick(number, START + number * MILLISECOND)
        here = [m for m in bus.sent[before:] if m.arbitration_id == STATUS]
        at += [number] * len(here)
        assert sum(m.arbitration_id == COMMAND for m in bus.sent[before:]) == 1
    assert at == list(range(1, 102, round(STATUS_PERIOD * 1000)))
    assert [status.tick for status in sent(bus, STATUS)] == at
    for status in sent(bus, STATUS):
        assert (status.phase, status.authority) == (Phase.IDLE, Authority.NONE)
        assert status.trip == TripReason.NONE
    assert all(message.is_extended_id is False for message in bus.sent)


def test_a_status_names_why_the_trial_ended():
    bus = Deaf()
    own = gateway(bus)
    own.tick(1, START)
    own.stop(START + MILLISECOND)
    assert own.state.trip.reason == TripReason.STOPPED
    assert own.state.trip.detail == "stopped by the operator"
    assert own.state.since == (START + MILLISECOND) / SECOND
    for number in range(2, 23):
        own.tick(number, START + number * MILLISECOND)
    last: TrialStatus = sent(bus, STATUS)[-1]
    assert (last.phase, last.trip) == (Phase.TRIPPED, TripReason.STOPPED)


def test_a_clock_that_begins_at_0_has_its_first_status_at_0():
    bus = Deaf()
    gateway(bus).tick(1, 0)
    assert [status.tick for status in sent(bus, STATUS)] == [1]


@pytest.mark.parametrize(
    ("phase", "authority"),
    [
        (Phase.ARMED, Authority.NONE),
        (Phase.EXCITING, Authority.THROTTLE),
        (Phase.SETTLING, Authority.THROTTLE),
        (Phase.HANDING_BACK, Authority.THROTTLE),
        (Phase.DONE, Authority.NONE),
    ],
)
def test_a_status_claims_authority_while_the_bench_holds_it(phase, authority):
    world = in_phase(phase)
    world.button = phase != Phase.ARMED
    world.gateway._buses[0].port = bus = Deaf(world.wire.waiting)
    world.gateway._status_due = 0.0
    world.gateway.tick(world.number + 1, world.due + MILLISECOND)
    assert [(status.phase, status.authority) for status in sent(bus, STATUS)] == [
        (world.gateway.state.phase, authority)
    ]


def test_every_phase_is_noted_once_with_the_time_at_which_it_began():
    world, seen, phase = World("throttle"), [], Phase.IDLE
    for _ in range(80):
        world.button = world.gateway.expects_the_button
        world.tick()
        if world.gateway.state.phase != phase:
            phase = world.gateway.state.phase
            seen.append(PhaseChange(phase, world.due))
        if phase in ENDED:
            break
    assert world.gateway.changes == seen
    assert [change.phase for change in seen][:2] == [Phase.ARMED, Phase.EXCITING]


def test_the_gateway_stays_released_for_a_while_after_the_end_and_then_ends():
    own = gateway(Deaf())
    own.stop(START)
    for number in range(1, 300):
        due = START + number * MILLISECOND
        goes_on = own.tick(number, due)
        assert goes_on == (due - START < AFTERWARDS * 1e9 - 1000), number
        if not goes_on:
            break
    assert number == round(AFTERWARDS * 1000)
    assert len(own.changes) == 1


@pytest.mark.parametrize(("number", "behind"), [(MOST_FRAMES - 1, False), (MOST_FRAMES, True)])
@pytest.mark.parametrize("phase", [Phase.IDLE, Phase.ARMED, Phase.EXCITING])
def test_more_frames_than_a_tick_hears_are_no_present(number, behind, phase):
    """With authority the trial ends; before it nothing is believed."""
    world = in_phase(phase)
    world.wire.waiting.clear()
    for _ in range(number):
        world.put(0x7F0, b"")
    world.wrong["dropped"] = set(world.counters)
    world.tick()
    trip = world.gateway.state.trip
    if phase in HOLDING and behind:
        assert (trip.reason, trip.detail) == (TripReason.TIMING, BEHIND)
        assert world.asked.authority == Authority.NONE
    else:
        assert trip is None


def test_while_frames_wait_the_button_is_not_heard_and_not_expected():
    world = in_phase(Phase.ARMED)
    world.button = False
    world.tick()
    assert world.gateway.expects_the_button
    world.say("RiderControls", world.message("RiderControls"))
    assert not world.gateway.attend(world.due + 100_000)
    assert world.gateway.expects_the_button
    world.button = True
    world.say("RiderControls", world.message("RiderControls"))
    assert world.gateway.attend(world.due + 200_000)
    for _ in range(MOST_FRAMES):
        world.put(0x7F0, b"")
    assert not world.gateway.attend(world.due + 300_000)
    assert not world.gateway.expects_the_button
    world.wire.waiting.clear()
    world.tick()  # what waited makes this tick one of the past as well
    assert world.gateway.state.phase != Phase.EXCITING


@pytest.mark.parametrize("phase", [Phase.IDLE, Phase.EXCITING, Phase.SETTLING])
def test_the_button_is_expected_of_an_armed_trial_alone(phase):
    assert not in_phase(phase).gateway.expects_the_button


def test_refusals_are_counted_noted_and_forgotten_with_the_first_frame_that_is_taken():
    bus = Deaf()
    own = gateway(bus)
    assert own.refused is False
    bus.fault = can.CanOperationError("no room")
    own.tick(1, START)
    assert own.refused
    assert own.refusals[0] == "no room"
    bus.fault = None
    own.tick(2, START + MILLISECOND)
    assert not own.refused
    assert own._buses[0].refused == 0
    bus.fault = can.CanOperationError("no room")
    for number in range(3, 3 + MOST_NOTES):
        own.tick(number, START + number * MILLISECOND)
    assert len(own.refusals) == MOST_NOTES


@pytest.mark.parametrize(("in_a_row", "off"), [(2, False), (3, True)])
def test_the_bus_is_off_from_the_third_refused_frame_in_a_row_on(in_a_row, off):
    """From the first tick on: then nothing has been taken before."""
    bus, seen, left = Deaf(), [], in_a_row
    own = gateway(bus)
    taken, state = bus.send, own._monitor.state

    def send(message):
        nonlocal left
        left -= 1
        if left >= 0:
            raise can.CanOperationError("no room")
        taken(message)

    def watched(now, **kind):
        seen.append(kind["bus_off"])
        return state(now, **kind)

    bus.send, own._monitor.state = send, watched
    for number in range(1, 6):
        own.tick(number, START + number * MILLISECOND)
    assert any(seen) == off
    assert own.refusals == ["no room"] * in_a_row


def test_a_bench_none_of_whose_commands_was_taken_gets_no_authority():
    """The bus took every status: no frame is refused in a row, and the button is expected."""
    world = World("throttle")
    world.judge.look = lambda *_: None  # it expects a command in each tick
    taken, statuses = world.wire.send, 0

    def send(message):
        nonlocal statuses
        if message.arbitration_id == COMMAND:
            raise can.CanOperationError("no room")
        statuses += 1
        taken(message)

    world.wire.send = send
    while statuses < 2:  # after a status that was taken no frame is refused in a row
        world.tick()
    assert world.gateway.expects_the_button
    world.button = True
    world.tick()
    trip = world.gateway.state.trip
    assert trip is not None
    assert trip.reason == TripReason.TIMING
    assert "last command" in trip.detail


def test_a_bus_that_cannot_be_read_is_off_after_three_ticks_without_a_frame():
    world = in_phase(Phase.EXCITING)

    def refuses(_timeout):
        raise can.CanOperationError("gone")

    world.wire.recv = refuses
    world.wire.refuses = True
    world.gateway.tick(world.number + 1, world.due + MILLISECOND)  # refused: one of each
    world.gateway.tick(world.number + 2, world.due + 2 * MILLISECOND)
    assert world.gateway.state.trip.reason == TripReason.BUS_OFF
    assert "gone" in world.gateway.refusals


def test_an_error_frame_that_says_bus_off_ends_the_trial_and_is_no_message():
    world = in_phase(Phase.EXCITING)
    world.put(BUS_OFF_ERROR, bytes(8), is_error_frame=True)
    world.tick()
    assert world.gateway.state.trip.reason == TripReason.BUS_OFF


@pytest.mark.parametrize("kind", ["is_remote_frame", "is_extended_id", ""])
def test_another_bench_is_found_by_its_frames_and_a_frame_of_another_kind_is_not_one(kind):
    world = in_phase(Phase.EXCITING)
    asks = ActuatorCommand(Authority.THROTTLE, 0.9, 0.0, 0.0)
    identifier, data = codec().encode(asks, counter=3)
    frame = can.Message(
        arbitration_id=identifier,
        data=b"" if kind == "is_remote_frame" else data,
        **{"is_extended_id": False, **({kind: True} if kind else {})},
    )
    world.wire.waiting.append(frame)
    world.tick()
    trip = world.gateway.state.trip
    assert (trip is not None) == (kind == "")
    if trip is not None:
        assert trip.reason == TripReason.TWO_SENDERS
        assert trip.detail == "another bench sends ActuatorCommand on this bus"


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [("stuck", TripReason.FAULTY), ("damaged", TripReason.FAULTY), ("dropped", TripReason.STALE)],
)
def test_a_status_whose_counter_stands_or_whose_crc_is_wrong_is_faulty_and_a_silent_one_stale(
    wrong, reason
):
    world = in_phase(Phase.EXCITING)
    world.wrong[wrong] = {"EngineStatus"}
    for _ in range(8):
        world.tick()
    trip = world.gateway.state.trip
    assert trip is not None
    assert trip.reason == reason
    assert "EngineStatus" in trip.detail


@pytest.mark.parametrize("offset", [1, 7, 14])
def test_a_second_vehicle_is_found_by_its_counter(offset):
    world = World("throttle")
    for _ in range(10):
        counter = (world.counters["OpticalSpeed"] + offset) % 15
        world.put(*codec().encode(world.message("OpticalSpeed"), counter=counter))
        world.tick()
    trip = world.gateway.state.trip
    assert trip is not None
    assert trip.reason == TripReason.TWO_SENDERS
    assert "OpticalSpeed is counted by more than one sender" in trip.detail


def test_a_status_without_protection_is_heard_although_nothing_counts_it():
    message = DATABASE.message("RiderControls")
    signals = tuple(s for s in message.signals if s.name not in ("crc", "counter"))
    plain = replace(message, signals=signals, protection=None)
    database = replace(
        DATABASE, messages=tuple(plain if m is message else m for m in DATABASE.messages)
    )
    bus, codec_ = Deaf(), Codec(database)
    own = Gateway(plan("throttle"), bus, own_binding(database), Ring.local(64), WHEELS)
    for number, button in enumerate((False, True, True, False)):
        rider = RiderControls(button, 0.1, 0.0, 0.0, 0.0)
        identifier, data = codec_.encode(rider)
        bus.waiting.append(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))
        assert own.attend(START + number * MILLISECOND) == button


def test_a_command_that_is_not_permitted_becomes_a_release_of_the_same_tick():
    world = in_phase(Phase.EXCITING)
    wrap = codec().period("ActuatorCommand", "time")
    assert (world.due / SECOND - world.asked.time + 1e-3) % wrap == pytest.approx(1e-3, abs=2e-6)
    world.brakes[0] = 4e6
    world.tick()
    assert world.gateway.state.trip.reason == TripReason.BRAKE
    assert world.gateway.state.since == world.due / SECOND
    assert (world.asked.authority, world.asked.throttle) == (Authority.NONE, 0.0)
    assert (world.due / SECOND - world.asked.time + 1e-3) % wrap == pytest.approx(1e-3, abs=2e-6)
    assert world.gateway.refusals == []


def test_the_distance_of_a_trial_counts_from_its_button():
    world, starts = in_phase(Phase.ARMED), []
    world.gateway._monitor.start_distance = starts.append
    for _ in range(80):
        world.button = world.gateway.state.phase != Phase.ARMED or world.gateway.state.released
        world.tick()
        if world.gateway.state.phase in ENDED:
            break
    assert world.gateway.state.phase == Phase.DONE
    (pressed,) = (c.time_ns for c in world.gateway.changes if c.phase == Phase.EXCITING)
    assert starts == [pressed / SECOND]


def test_frames_that_were_lost_do_not_spoil_the_next_one():
    world = in_phase(Phase.EXCITING)
    for _ in range(3):
        world.counters["EngineStatus"] = (world.counters["EngineStatus"] + 3) % 15
        world.tick()
        assert world.gateway.state.trip is None


def test_what_is_heard_counts_as_old_as_the_tick_before():
    """A frame may have waited since the bench listened last."""
    world = in_phase(Phase.ARMED)
    before = world.due
    world.tick(3 * MILLISECOND)
    found = world.gateway._monitor.state(world.due / 1e9)
    assert found.oldest_age == pytest.approx((world.due - before) / 1e9, abs=1e-6)
    world.gateway.attend(world.due + MILLISECOND // 2)
    world.tick()  # the bench listened half a tick ago
    found = world.gateway._monitor.state(world.due / 1e9)
    assert found.oldest_age == pytest.approx(0.5e-3, abs=1e-6)
    first = World("throttle")
    first.tick()  # nobody knows since when these frames waited
    assert first.gateway._monitor.state(first.due / 1e9).oldest_age == math.inf
    assert "silent" in not_ready(first.gateway._monitor.state(first.due / 1e9), first.plan)


def test_periodic_messages_are_those_with_a_cycle_time_that_are_sent_by_it():
    messages = (
        Message("cyclic", 1, 8, cycle_time=0.01),
        Message("named cyclic", 2, 8, cycle_time=0.02, attributes={"GenMsgSendType": 0}),
        Message("on event", 3, 8, cycle_time=0.02, attributes={"GenMsgSendType": 1}),
        Message("without", 4, 8),
    )
    assert cycles_of(messages) == {"cyclic": 0.01, "named cyclic": 0.02}


def broken(*_arguments):
    raise ZeroDivisionError("made by the test")


def test_a_tick_that_fails_releases_reports_and_records_until_the_end():
    """From the first failing tick on: a release each, a status every 20 ms, frames in the record."""
    bus, ring = Deaf(), Ring.local(2048)
    own = gateway(bus, ring)
    own.tick(1, START)
    own._decide = broken
    bus.sent.clear()
    own._status_due = 0.0
    for number in range(2, 400):
        due = START + number * MILLISECOND
        bus.waiting = [can.Message(arbitration_id=0x55, timestamp=7.25, is_extended_id=False)]
        if not own.tick(number, due):
            break
    trip = own.state.trip
    assert (own.state.phase, trip.reason) == (Phase.TRIPPED, TripReason.INTERNAL_ERROR)
    assert trip.detail == own.refusals[0]
    assert "in tick 2: ZeroDivisionError: made by the test" in trip.detail
    first = START + 2 * MILLISECOND
    assert own.changes == [PhaseChange(Phase.TRIPPED, first)]
    assert number - 2 - round(AFTERWARDS * 1000) in (0, 1)  # floats of a time of day are coarse
    releases, statuses = sent(bus, COMMAND), sent(bus, STATUS)
    assert len(releases) == number - 1
    assert {command.authority for command in releases} == {Authority.NONE}
    assert all(message.is_extended_id is False for message in bus.sent)
    times = np.array([command.time for command in releases])
    wrap = codec().period("ActuatorCommand", "time")
    np.testing.assert_allclose(np.diff(times) % wrap, 0.001, atol=3e-6)
    assert [status.tick for status in statuses] == list(range(2, number + 1, 20))
    assert {(s.phase, s.authority, s.trip) for s in statuses} == {
        (Phase.TRIPPED, Authority.NONE, TripReason.INTERNAL_ERROR)
    }
    counters = [codec().counter(COMMAND, m.data) for m in bus.sent if m.arbitration_id == COMMAND]
    assert all((b - a) % 15 == 1 for a, b in pairwise(counters))
    frames = [slot for slot in ring.drain() if slot.identifier == 0x55]
    assert len(frames) == number - 1
    assert {(slot.time_ns, slot.flags) for slot in frames} == {(7_250_000_000, 0)}
    assert not own.expects_the_button
    assert not own.refused


def test_a_tick_that_fails_at_time_0_reports_at_once():
    bus = Deaf()
    own = gateway(bus)
    own._listen = broken
    own.tick(1, 0)
    assert [status.trip for status in sent(bus, STATUS)] == [TripReason.INTERNAL_ERROR]


def test_an_exception_after_the_end_changes_neither_the_outcome_nor_when_the_bench_leaves():
    world = in_phase(Phase.DONE)
    changes, ended = list(world.gateway.changes), world.due
    bus = world.gateway._buses[0].port = Deaf()
    world.gateway._decide = broken
    for number in range(1, 300):
        due = ended + number * MILLISECOND
        if not world.gateway.tick(world.number + number, due):
            break
    assert number == pytest.approx(AFTERWARDS * 1000, abs=1)
    assert (world.gateway.state.phase, world.gateway.state.trip) == (Phase.DONE, None)
    assert world.gateway.changes == changes
    assert {(s.phase, s.trip) for s in sent(bus, STATUS)} == {(Phase.DONE, TripReason.NONE)}
    assert {command.authority for command in sent(bus, COMMAND)} == {Authority.NONE}


def test_a_first_tick_that_fails_records_what_waits_and_names_itself_before_other_notes():
    bus, ring = Deaf([can.Message(arbitration_id=0x55, is_extended_id=False)]), Ring.local(64)
    own = gateway(bus, ring)
    own.refusals.append("no room")
    own._listen = broken
    own.tick(1, START)
    assert [slot.identifier for slot in ring.drain()] == [0x55]
    assert "in tick 1: ZeroDivisionError" in own.refusals[0]
    assert own.refusals[1:] == ["no room"]
    assert own.state.since == START / SECOND


@pytest.mark.parametrize("echoes", [False, True])
def test_what_is_sent_after_an_exception_is_recorded_once(echoes):
    """By its echo, or where the interface has none when it is handed over."""
    bus, ring = Deaf(), Ring.local(1024)
    own = gateway(bus, ring)
    fails = 61  # a status is due in this tick
    for number in range(1, fails):
        if echoes:
            bus.waiting = list(bus.sent[-2:])
        own.tick(number, START + number * MILLISECOND)
    list(ring.drain())
    own._decide = broken
    due = START + fails * MILLISECOND
    bus.waiting = []
    before = len(bus.sent)
    own.tick(fails, due)
    now = list(ring.drain())
    if echoes:
        assert now == []
        bus.waiting = list(bus.sent[before:])
        own._put_now = broken
        own.tick(fails + 1, due + MILLISECOND)
        assert [(s.identifier, s.flags) for s in ring.drain()] == [(COMMAND, SENT), (STATUS, SENT)]
    else:
        expected = [(COMMAND, SENT, due), (STATUS, SENT, due)]
        assert [(s.identifier, s.flags, s.time_ns) for s in now] == expected


def test_what_arrives_after_the_bench_listened_is_recorded_in_the_tick_that_fails():
    frames = [can.Message(arbitration_id=each, is_extended_id=False) for each in (0x55, 0x56)]
    bus, ring = Deaf(frames[:1]), Ring.local(64)
    own = gateway(bus, ring)

    def fails(*_arguments):
        bus.waiting.append(frames[1])
        raise ZeroDivisionError("made by the test")

    own._decide = fails
    own.tick(1, START)
    assert [slot.identifier for slot in ring.drain()] == [0x55, 0x56]


def test_a_frame_whose_stamp_fails_is_recorded_at_the_time_of_the_tick():
    frames = [can.Message(arbitration_id=each, is_extended_id=False) for each in (0x55, 0x56)]
    ring = Ring.local(64)
    gateway(Deaf(frames), ring, stamps=(broken,)).tick(1, START)
    assert [(slot.identifier, slot.time_ns) for slot in ring.drain()] == [
        (0x55, START),
        (0x56, START),
    ]


@pytest.mark.parametrize("fails", [False, True])
def test_the_bench_leaves_the_bus_exactly_when_its_time_after_the_end_is_over(fails):
    """On a clock that begins at 0, where a float of the time is exact."""
    own = gateway(Deaf())
    if fails:
        own._listen = broken
        own.tick(0, 0)
    else:
        own.stop(0)
    last = round(AFTERWARDS * SECOND)
    assert own.tick(1, last - 1)
    assert not own.tick(2, last)


@pytest.mark.parametrize(
    ("call", "where"), [("attend", "between two ticks"), ("stop", "while it was stopped")]
)
def test_what_fails_beside_a_tick_ends_the_trial_as_well(call, where):
    own = gateway(Deaf())
    own.tick(1, START)
    own._listen = own._move_to = broken
    assert getattr(own, call)(START + MILLISECOND) in (True, None)
    assert own.state.trip.reason == TripReason.INTERNAL_ERROR
    assert where in own.state.trip.detail

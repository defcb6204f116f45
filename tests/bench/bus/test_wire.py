"""Laws of the wire: order, time, conservation of frames, and fault confinement."""

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.bench.bus.counters import Confinement, Counters
from slipbench.bench.bus.events import Cause, Delivery, Event, Notice
from slipbench.bench.bus.faults import NO_FAULTS, Disturbed, FaultPlan, Where
from slipbench.bench.bus.frame import BitRates, Frame
from slipbench.bench.bus.node import ROOM, Node
from slipbench.bench.bus.queues import MostUrgent
from slipbench.bench.bus.wire import Wire

RATES = BitRates(500_000, 2_000_000)
BIT = 2000  # ns
SECOND = 1_000_000_000
few = settings(max_examples=40, deadline=None)
FOR_EVER = 1000 * SECOND
FD_LENGTHS = (*range(9), 12, 16, 20, 24, 32, 48, 64)


def remote(identifier: int, requested: int) -> Frame:
    return Frame(identifier, b"", requested=requested)


def long(identifier: int, data: bytes) -> Frame:
    return Frame(identifier, data, extended=True)


def short(identifier: int, data: bytes) -> Frame:
    return Frame(identifier, data)


def wide(identifier: int, data: bytes, switches_rate: bool, error_passive: bool) -> Frame:
    return Frame(identifier, data, False, True, switches_rate, error_passive)


def classic_frames() -> st.SearchStrategy[Frame]:
    data = st.binary(max_size=8)
    return st.one_of(
        st.builds(short, st.integers(0, 0x7FF), data),
        st.builds(long, st.integers(0, 0x1FFFFFFF), data),
    )


def remote_frames() -> st.SearchStrategy[Frame]:
    return st.builds(remote, st.integers(0, 0x7FF), st.integers(0, 8))


def fd_frames() -> st.SearchStrategy[Frame]:
    data = st.sampled_from(FD_LENGTHS).flatmap(lambda n: st.binary(min_size=n, max_size=n))
    return st.builds(wide, st.integers(0, 0x7FF), data, st.booleans(), st.booleans())


Offers = list[tuple[int, int, Frame]]  # time in us, sender, frame


def offers(most: int = 40) -> st.SearchStrategy[Offers]:
    """Frames of three senders; no identifier has two, as on a bus that is set up well."""

    def of_its_sender(offer: tuple[int, Frame]) -> tuple[int, int, Frame]:
        time, frame = offer
        return time, frame.identifier % 3, frame

    frames = st.tuples(st.integers(0, 20_000), classic_frames() | fd_frames() | remote_frames())
    return st.lists(frames.map(of_its_sender), max_size=most).map(
        lambda each: sorted(each, key=lambda o: o[0])
    )


def carried(wire: Wire, nodes: list[Node], sent: Offers, until: int = FOR_EVER) -> list[Event]:
    events = []
    for time, sender, frame in sent:
        events += wire.advance(time * 1000)
        assert wire.offer(frame, nodes[sender], time * 1000)
    return events + wire.advance(until)


def bus(
    urgent: bool = False, faults: FaultPlan = NO_FAULTS, restart: float | None = None
) -> tuple[Wire, list[Node]]:
    wire = Wire(RATES, faults)
    nodes = [
        wire.attach(f"node {n}", MostUrgent() if urgent else None, restart_after=restart)
        for n in range(4)
    ]
    return wire, nodes


def received(events: list[Event], node: Node) -> list[Frame]:
    return [
        each.frame
        for each in events
        if isinstance(each, Delivery) and each.node is node and not each.own
    ]


def sent_whole(events: list[Event]) -> list[Delivery]:
    return [each for each in events if isinstance(each, Delivery) and each.own]


def content(events: list[Event]) -> list[object]:
    """Events with their nodes' names, so that two wires can be compared."""
    return [(each.node.name, each[0], *each[2:]) for each in events]


def notices(events: list[Event], node: Node) -> list[Notice]:
    return [each for each in events if isinstance(each, Notice) and each.node is node]


@few
@given(offers(), st.booleans())
def test_without_a_fault_every_node_receives_every_frame_once(sent: Offers, urgent: bool) -> None:
    wire, nodes = bus(urgent)
    events = carried(wire, nodes, sent)
    for number, node in enumerate(nodes):
        wanted = [frame for _, sender, frame in sent if sender != number]
        assert sorted(received(events, node), key=repr) == sorted(wanted, key=repr)
    assert not any(isinstance(each, Notice) for each in events)


@few
@given(offers())
def test_what_one_queue_sends_keeps_its_order(sent: Offers) -> None:
    wire, nodes = bus()
    events = carried(wire, nodes, sent)
    for number in range(3):
        own = [each.frame for each in sent_whole(events) if each.node is nodes[number]]
        assert own == [frame for _, sender, frame in sent if sender == number]


@few
@given(offers(), st.booleans())
def test_a_frame_that_begins_has_the_lowest_identifier_of_all_that_are_ready(
    sent: Offers, urgent: bool
) -> None:
    """A frame that was sent later came later, was less urgent, or was behind another in its queue."""
    wire, nodes = bus(urgent)
    witness = nodes[3]
    waiting = [(time * 1000, sender, frame) for time, sender, frame in sent]
    for event in carried(wire, nodes, sent):
        if not (isinstance(event, Delivery) and event.node is witness):
            continue
        begin = event.time_ns + 3 * BIT - round(RATES.duration(event.frame))
        heads, seen = [], set()
        for time, sender, frame in waiting:
            if time <= begin and (urgent or sender not in seen):
                heads.append(frame.priority)
            seen.add(sender)
        assert event.frame.priority == min(heads)
        waiting.remove(next(each for each in waiting if each[2] == event.frame))


@few
@given(offers())
def test_frames_follow_each_other_at_least_their_own_length_apart(sent: Offers) -> None:
    wire, nodes = bus()
    heard = [each for each in carried(wire, nodes, sent) if isinstance(each, Delivery)]
    heard = [each for each in heard if each.node is nodes[3]]
    for before, after in pairwise(heard):
        assert after.time_ns - before.time_ns >= round(RATES.duration(after.frame))


@few
@given(classic_frames() | fd_frames() | remote_frames())
def test_a_frame_on_an_idle_bus_takes_its_bits_over_the_bit_rate(frame: Frame) -> None:
    wire, nodes = bus()
    events = carried(wire, nodes, [(7, 0, frame)])
    heard = next(each for each in events if each.node is nodes[3])
    assert heard.time_ns == 7000 + round(RATES.duration(frame)) - 3 * BIT
    assert wire.busy_ns == round(RATES.duration(frame))


@few
@given(offers(), st.integers(1, 30_000))
def test_the_load_never_exceeds_the_wire(sent: Offers, now: int) -> None:
    wire, nodes = bus()
    events = carried(wire, nodes, [each for each in sent if each[0] <= now], now * 1000)
    assert 0 <= wire.busy_ns <= wire.now_ns
    events += wire.advance(FOR_EVER)
    lengths = [round(RATES.duration(each.frame)) for each in sent_whole(events)]
    assert wire.busy_ns == sum(lengths)


@few
@given(offers(), st.lists(st.integers(0, 40_000), max_size=20), st.integers(0, 2**32))
def test_the_steps_of_advance_do_not_change_the_events(
    sent: Offers, looks: list[int], seed: int
) -> None:
    plan = FaultPlan((Disturbed(0.2),), seed)
    wire, nodes = bus(faults=plan)
    once = content(carried(wire, nodes, sent))
    wire, nodes = bus(faults=plan)
    often: list[Event] = []
    for time, what in sorted(
        [(time, (sender, frame)) for time, sender, frame in sent]
        + [(look, None) for look in looks],
        key=lambda each: each[0],
    ):
        often += wire.advance(time * 1000)
        if what is not None:
            wire.offer(what[1], nodes[what[0]], time * 1000)
    often += wire.advance(FOR_EVER)
    assert content(often) == once


@few
@given(offers(), st.floats(0.0, 0.5), st.integers(0, 2**32))
def test_what_is_destroyed_on_the_wire_is_sent_again_and_still_arrives_once(
    sent: Offers, chance: float, seed: int
) -> None:
    wire, nodes = bus(faults=FaultPlan((Disturbed(chance),), seed))
    events = carried(wire, nodes, sent)
    lost = sum(each.dropped for each in events if isinstance(each, Notice))
    own = sent_whole(events)
    assert len(own) + lost == len(sent)
    for node in nodes[3:]:
        assert len(received(events, node)) == len(own)


FOREVER_DISTURBED = FaultPlan((Disturbed(1.0, Where(senders={"node 0"})),))


def test_a_node_that_only_fails_is_passive_after_16_errors_and_bus_off_after_32() -> None:
    wire, nodes = bus(faults=FOREVER_DISTURBED)
    events = carried(wire, nodes, [(0, 0, Frame(1, b"")), (0, 0, Frame(2, b""))], SECOND)
    told = notices(events, nodes[0])
    assert [each.counters.transmit for each in told] == [8 * n for n in range(1, 33)]
    assert told[14].counters.state < Confinement.PASSIVE
    assert told[15].counters.state is Confinement.PASSIVE
    assert told[-1].counters.state is Confinement.OFF
    assert told[-1].dropped == 2
    assert not wire.offer(Frame(3, b""), nodes[0], wire.now_ns)


def test_receivers_count_one_for_each_error_and_never_go_bus_off() -> None:
    wire, nodes = bus(faults=FaultPlan((Disturbed(1.0),)), restart=0.0)
    for _ in range(10):
        wire.offer(Frame(1, b""), nodes[0], wire.now_ns)
        wire.advance(wire.now_ns + SECOND)
    assert nodes[1].counters == Counters(0, 128)
    assert nodes[1].state is Confinement.PASSIVE


def test_a_bus_off_node_neither_receives_nor_acknowledges() -> None:
    wire, nodes = bus(faults=FOREVER_DISTURBED)
    carried(wire, nodes, [(0, 0, Frame(1, b""))], SECOND)
    wire.offer(Frame(5, b""), nodes[1], wire.now_ns)
    events = wire.advance(2 * SECOND)
    assert received(events, nodes[0]) == []
    assert received(events, nodes[2]) == [Frame(5, b"")]
    for each in nodes[2:]:
        wire.detach(each)
    wire.offer(Frame(6, b""), nodes[1], wire.now_ns)
    assert {each.cause for each in notices(wire.advance(3 * SECOND), nodes[1])} == {
        Cause.UNACKNOWLEDGED
    }


def test_recovery_takes_128_times_11_recessive_bits_of_an_idle_bus() -> None:
    wire, nodes = bus(faults=FOREVER_DISTURBED)
    carried(wire, nodes, [(0, 0, Frame(1, b""))], SECOND)
    assert wire.advance(2 * SECOND) == []  # it stays off until it is told to come back
    wire.restart(nodes[0], 2 * SECOND)
    [back] = wire.advance(3 * SECOND)
    assert back == Notice(2 * SECOND + 128 * 11 * BIT, nodes[0], Cause.RESTARTED, Counters(), False)


@few
@given(st.integers(1, 300))
def test_under_traffic_each_frame_counts_once_towards_recovery(count: int) -> None:
    """Its acknowledgement's delimiter, end and intermission are 11 recessive bits."""
    wire, nodes = bus(faults=FOREVER_DISTURBED)
    carried(wire, nodes, [(0, 0, Frame(1, b""))], SECOND)
    wire.restart(nodes[0], SECOND)
    for _ in range(count):
        wire.offer(Frame(2, b"12345678"), nodes[1], SECOND)
    wire.offer(Frame(2, b"12345678"), nodes[1], SECOND)
    busy = round((count + 0.5) * RATES.duration(Frame(2, b"12345678")))
    assert nodes[0].off
    wire.advance(SECOND + busy)
    assert nodes[0].off == (count < 128)


def test_a_single_node_becomes_passive_and_never_goes_bus_off() -> None:
    wire = Wire(RATES)
    node = wire.attach("alone")
    wire.offer(Frame(1, b""), node, 0)
    told = notices(wire.advance(SECOND), node)
    assert {each.cause for each in told} == {Cause.UNACKNOWLEDGED}
    assert node.counters == Counters(128, 0)
    again = told[1].time_ns - told[0].time_ns + 8 * BIT  # what the first ones did not wait
    assert wire.busy_ns / SECOND == pytest.approx(1 - 8 * BIT / again, abs=1e-3)
    assert wire.next_ns is None
    listener = wire.attach("listener")
    events = wire.advance(2 * SECOND)
    assert received(events, listener) == [Frame(1, b"")]
    assert node.counters.transmit == 127


def test_a_passive_node_lets_the_others_go_first_for_eight_bits() -> None:
    wire, nodes = bus(faults=FaultPlan((Disturbed(1.0, Where(senders={"node 0"}, end=0.01)),)))
    nodes[0].counters, nodes[0].state = Counters(130, 0), Confinement.PASSIVE
    start = 20 * SECOND // 1000
    wire.advance(start)
    for _ in range(2):
        wire.offer(Frame(1, b""), nodes[0], start)
    wire.offer(Frame(2, b""), nodes[1], start)
    heard = received(wire.advance(SECOND), nodes[3])
    assert [frame.identifier for frame in heard] == [1, 2, 1]


def test_two_senders_of_one_identifier_collide_until_one_gives_way() -> None:
    wire, nodes = bus()
    wire.offer(Frame(1, b"\x00"), nodes[0], 0)
    wire.offer(Frame(1, b"\x01"), nodes[1], 0)
    events = wire.advance(SECOND)
    collisions = [each for each in notices(events, nodes[0]) if each.cause is Cause.COLLISION]
    assert len(collisions) == 16  # then both are passive, and the loser cannot hurt
    assert {each.cause for each in notices(events, nodes[1])} == {Cause.COLLISION}
    assert received(events, nodes[2]) == [Frame(1, b"\x00"), Frame(1, b"\x01")]


def test_two_equal_frames_at_once_are_one() -> None:
    wire, nodes = bus()
    for node in nodes[:2]:
        wire.offer(Frame(1, b"x"), node, 0)
    events = wire.advance(SECOND)
    assert received(events, nodes[2]) == [Frame(1, b"x")]
    assert len(sent_whole(events)) == 2


def test_a_full_queue_refuses() -> None:
    wire, nodes = bus()
    taken = [wire.offer(Frame(1, b""), nodes[0], 0) for _ in range(ROOM + 5)]
    assert taken == [True] * ROOM + [False] * 5


def test_what_a_node_was_given_before_it_left_is_still_sent() -> None:
    wire, nodes = bus()
    wire.offer(Frame(1, b""), nodes[0], 0)
    wire.offer(Frame(2, b""), nodes[0], 0)
    wire.detach(nodes[0])
    assert [frame.identifier for frame in received(wire.advance(SECOND), nodes[1])] == [1, 2]


def test_a_node_that_joins_during_a_frame_does_not_receive_it() -> None:
    wire, nodes = bus()
    wire.offer(Frame(1, b"12345678"), nodes[0], 0)
    wire.advance(50 * BIT)
    late = wire.attach("late")
    events = wire.advance(SECOND)
    assert received(events, nodes[1]) == [Frame(1, b"12345678")]
    assert received(events, late) == []


@pytest.mark.parametrize("fd", [True, False])
def test_a_node_without_can_fd_is_given_none(fd: bool) -> None:
    wire = Wire(RATES)
    sender, listener = wire.attach("sender"), wire.attach("listener", fd=fd)
    wire.offer(Frame(1, b"", fd=True), sender, 0)
    assert len(received(wire.advance(SECOND), listener)) == fd

"""Properties that the bench needs of every bus: the same laws on every kind of bus."""

import can
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.bench.bus.wires import Wire, carry, receive, send

CLASSIC_LENGTHS = range(9)
FD_LENGTHS = (*range(9), 12, 16, 20, 24, 32, 48, 64)


def frame(identifier: int = 0x100, data: bytes = b"", **kind: bool) -> can.Message:
    return can.Message(arbitration_id=identifier, data=data, **{"is_extended_id": False, **kind})


def content(message: can.Message) -> tuple[int, bool, bool, bytes]:
    return (message.arbitration_id, message.is_extended_id, message.is_fd, bytes(message.data))


def classic_frames() -> st.SearchStrategy[can.Message]:
    data = st.binary(max_size=8)
    return st.one_of(
        st.builds(frame, st.integers(0, 0x7FF), data),
        st.builds(frame, st.integers(0, 0x1FFFFFFF), data, is_extended_id=st.just(True)),
    )


def fd_frames() -> st.SearchStrategy[can.Message]:
    data = st.sampled_from(FD_LENGTHS).flatmap(lambda n: st.binary(min_size=n, max_size=n))
    return st.builds(frame, st.integers(0, 0x7FF), data, is_fd=st.just(True))


def assert_arrives(wire: Wire, message: can.Message) -> None:
    sender, listener = wire.node(False), wire.node(False)
    send(sender, message)
    wire.settle()
    assert [content(each) for each in receive(listener, 1)] == [content(message)]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(message=classic_frames())
def test_a_frame_arrives_as_it_was_sent(wire: Wire, message: can.Message) -> None:
    assert_arrives(wire, message)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(message=fd_frames())
def test_a_frame_of_can_fd_arrives_as_it_was_sent(wire: Wire, message: can.Message) -> None:
    assert_arrives(wire, message)


@pytest.mark.parametrize("length", CLASSIC_LENGTHS)
def test_every_classic_length_arrives(wire: Wire, length: int) -> None:
    assert_arrives(wire, frame(data=bytes(range(length))))


@pytest.mark.parametrize("length", FD_LENGTHS)
def test_every_length_of_can_fd_arrives(wire: Wire, length: int) -> None:
    assert_arrives(wire, frame(data=bytes(range(length)), is_fd=True, bitrate_switch=True))


@pytest.mark.parametrize("identifier", [0, 0x7FF, 0x800, 0x1FFFFFFF])
def test_long_identifiers_stay_long(wire: Wire, identifier: int) -> None:
    assert_arrives(wire, frame(identifier, is_extended_id=True))


def test_frames_of_one_sender_keep_their_order(wire: Wire) -> None:
    sender, listener = wire.node(False), wire.node(False)
    sent = [frame(data=number.to_bytes(2, "big")) for number in range(500)]
    heard = carry(wire, sender, listener, sent)
    assert [content(each) for each in heard] == [content(each) for each in sent]


def test_every_listener_gets_every_frame(wire: Wire) -> None:
    sender, *listeners = (wire.node(False) for _ in range(4))
    for number in range(100):
        send(sender, frame(number, bytes([number])))
    wire.settle()
    heard = [[content(each) for each in receive(node, 100)] for node in listeners]
    assert len(heard[0]) == 100
    assert heard[0] == heard[1] == heard[2]


def test_a_listener_that_changes_its_frame_changes_no_other_copy(wire: Wire) -> None:
    sender, first, second = (wire.node(False) for _ in range(3))
    sent = frame(data=b"\x01\x02")
    send(sender, sent)
    wire.settle()
    receive(first, 1)[0].data[0] = 0xFF
    assert bytes(receive(second, 1)[0].data) == b"\x01\x02"
    assert bytes(sent.data) == b"\x01\x02"


def test_a_sender_receives_its_own_frames_only_on_request(wire: Wire) -> None:
    deaf, other = wire.node(False), wire.node(False)
    send(deaf, frame(0x101))
    send(other, frame(0x102))
    wire.settle()
    assert [each.arbitration_id for each in receive(deaf, 1)] == [0x102]
    assert deaf.recv(0) is None


def test_the_own_frames_of_a_node_are_marked_as_sent(wire: Wire) -> None:
    hearing, other = wire.node(True), wire.node(False)
    send(hearing, frame(0x101))
    wire.settle()
    assert [(each.arbitration_id, each.is_rx) for each in receive(other, 1)] == [
        (0x101, wire.knows_own)
    ]
    assert [(each.arbitration_id, each.is_rx) for each in receive(hearing, 1)] == [(0x101, False)]


def test_a_filter_lets_through_what_it_names_and_nothing_else(wire: Wire) -> None:
    sender, listener = wire.node(False), wire.node(False)
    listener.set_filters(
        [
            {"can_id": 0x120, "can_mask": 0x7F0, "extended": False},
            {"can_id": 0x18FF0000, "can_mask": 0x1FFF0000, "extended": True},
        ]
    )
    for identifier in range(0x110, 0x140):
        send(sender, frame(identifier))
    send(sender, frame(0x18FF1234, is_extended_id=True))
    send(sender, frame(0x18FE1234, is_extended_id=True))
    wire.settle()
    heard = [each.arbitration_id for each in receive(listener, 17)]
    assert heard == [*range(0x120, 0x130), 0x18FF1234]
    assert listener.recv(0) is None


def test_times_of_arrival_never_go_back(wire: Wire) -> None:
    sender, listener = wire.node(False), wire.node(False)
    for number in range(200):
        send(sender, frame(number))
    wire.settle()
    times = [each.timestamp for each in receive(listener, 200)]
    assert len(times) == 200
    assert times == sorted(times)


def test_no_node_receives_what_was_sent_before_it_joined(wire: Wire) -> None:
    sender, witness = wire.node(False), wire.node(False)
    send(sender, frame(0x101))
    wire.settle()
    receive(witness, 1)
    late = wire.node(False)
    send(sender, frame(0x102))
    wire.settle()
    assert [each.arbitration_id for each in receive(late, 1)] == [0x102]

"""Laws of our own end of the bus: which frames are ours, and whether the controller is on the bus."""

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.bench.gateway.controller_state import ControllerState
from slipbench.bench.gateway.tx_echo import PATIENCE, WAITING, TxEcho

# linux/can/error.h
BUS_OFF, RESTARTED, CONTROLLER = 0x40, 0x100, 0x4
ACTIVE, WARNING = 0x40, 0x04  # of the second byte


class Bus:
    """Says of itself what a test wants, as the interfaces of python-can do."""

    def __init__(self, says: can.BusState | Exception) -> None:
        self.says, self.asked = says, 0

    @property
    def state(self) -> can.BusState:
        self.asked += 1
        if isinstance(self.says, Exception):
            raise self.says
        return self.says


def error(number: int, data: bytes = bytes(8)) -> can.Message:
    return can.Message(arbitration_id=number, data=data, is_error_frame=True)


def test_a_controller_is_on_the_bus_until_it_says_otherwise():
    for says in (can.BusState.ACTIVE, can.BusState.PASSIVE, NotImplementedError()):
        state = ControllerState(Bus(says))
        assert not state.off()
        assert not state.off()
    assert ControllerState(Bus(can.BusState.ERROR)).off()
    assert ControllerState(Bus(can.CanOperationError("gone"))).off()


def test_a_bus_that_says_nothing_of_its_state_is_asked_once():
    """Each question costs time in the tick."""
    bus = Bus(NotImplementedError())
    state = ControllerState(bus)
    for _ in range(5):
        state.off()
    assert bus.asked == 1
    bus.says = can.BusState.ERROR
    assert not state.off()


def test_a_state_that_passes_is_off_while_it_lasts():
    bus = Bus(can.BusState.ERROR)
    state = ControllerState(bus)
    assert state.off()
    bus.says = can.BusState.ACTIVE
    assert not state.off()
    bus.says = can.CanOperationError("gone")
    assert state.off()
    assert state.off()


@pytest.mark.parametrize(
    "back",
    [error(RESTARTED), error(CONTROLLER, bytes((0, ACTIVE))), error(CONTROLLER | 1, b"\0\x40\0\0")],
)
def test_bus_off_lasts_until_the_controller_is_restarted_or_active(back):
    state = ControllerState(Bus(NotImplementedError()))
    state.error_frame(error(BUS_OFF))
    for _ in range(3):
        assert state.off()
    state.error_frame(back)
    assert not state.off()


@pytest.mark.parametrize(
    "other",
    [
        error(CONTROLLER, bytes((0, WARNING))),
        error(CONTROLLER, bytes(8)),
        error(CONTROLLER, bytes((ACTIVE,))),  # too short to say so
        error(CONTROLLER, bytes((ACTIVE, 0))),
        error(0x8, bytes((0, ACTIVE))),
        error(0, bytes((0, ACTIVE))),
    ],
)
def test_no_other_error_says_bus_off_or_ends_it(other):
    state = ControllerState(Bus(NotImplementedError()))
    state.error_frame(other)
    assert not state.off()
    state.error_frame(error(BUS_OFF))
    state.error_frame(other)
    assert state.off()
    assert state.off()  # not only was it off since this was asked last, it is still
    assert state.error_frames == 3


def test_a_bus_off_that_ended_before_it_was_asked_for_is_told_once():
    """Between two ticks commands may have been lost: the trial must know."""
    state = ControllerState(Bus(NotImplementedError()))
    state.error_frame(error(BUS_OFF))
    state.error_frame(error(RESTARTED))
    assert state.off()
    assert not state.off()
    state.error_frame(error(RESTARTED | BUS_OFF))
    assert state.off()
    assert state.off()


def test_a_frame_is_ours_as_often_as_it_was_sent():
    own = TxEcho()
    assert not own.heard(1, b"a")
    own.sent(1, b"a")
    assert not own.heard(2, b"a")
    assert not own.heard(1, b"b")
    assert own.heard(1, b"a")
    assert not own.heard(1, b"a")


@given(st.lists(st.integers(0, 2), max_size=30), st.lists(st.integers(0, 2), max_size=30))
def test_frames_of_one_identifier_are_heard_in_order_and_others_may_overtake(first, second):
    own = TxEcho()
    for number in range(max(len(first), len(second))):
        for identifier, sent in ((1, first), (2, second)):
            if number < len(sent):
                own.sent(identifier, bytes((number, sent[number])))
    for identifier, sent in ((2, second), (1, first)):
        for number, value in enumerate(sent):
            assert own.heard(identifier, bytes((number, value)))
    assert not own.heard(1, bytes((0, 0)))


def test_a_frame_that_is_heard_says_that_those_before_it_were_lost():
    own = TxEcho()
    for data in (b"a", b"b", b"c"):
        own.sent(1, data)
    own.sent(2, b"a")
    assert own.heard(1, b"b")
    assert not own.heard(1, b"a")
    assert own.heard(1, b"c")
    assert own.heard(2, b"a")


def test_an_interface_is_silent_that_returned_none_of_fifty_frames():
    own = TxEcho()
    for number in range(PATIENCE):
        assert not own.silent
        own.sent(number % 3, b"a")
    assert own.silent
    assert own.heard(0, b"a")
    assert not own.silent
    for _ in range(2 * PATIENCE):
        own.sent(1, b"b")
    assert not own.silent  # it echoed once: a loss is no silence
    other = TxEcho()
    assert not other.heard(1, b"a")
    for _ in range(PATIENCE):
        other.sent(1, b"b")
        other.heard(1, b"not ours")
    assert other.silent


def test_what_was_never_heard_is_remembered_up_to_a_bound():
    own = TxEcho()
    for number in range(WAITING + 1):
        own.sent(1, number.to_bytes(2, "little"))
    assert not own.heard(1, (0).to_bytes(2, "little"))
    assert own.heard(1, (1).to_bytes(2, "little"))

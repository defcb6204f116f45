"""Laws of one gateway on two buses: what it sends, hears and counts on each of them."""

import math

import can
import pytest

from slipbench.bench.bus.error_frames import BUS_OFF as BUS_OFF_ERROR
from slipbench.bench.bus.error_frames import RESTARTED
from slipbench.bench.gateway.gateway import BEHIND, MOST_FRAMES, Gateway
from slipbench.bench.gateway.gateway_bus import OFF_THE_BUS
from slipbench.bench.gateway.tx_echo import PATIENCE
from slipbench.bench.loop.ring import SENT, Ring
from slipbench.protocol.binding.binding import own_binding
from slipbench.protocol.codec.codec import Sender
from slipbench.protocol.codec.messages import Authority, EcuStatus, TripReason
from tests.bench.gateway.test_gateway_tick_laws import COMMAND, DATABASE, STATUS, Deaf
from tests.bench.safety.world import MILLISECOND, START, WHEELS, plan

CHASSIS = {"TrialStatus", "OpticalSpeed", "RearTeeth", "FrontTeeth", "ChassisStatus"}
BINDING = own_binding(
    DATABASE.on_buses(lambda name: "chassis" if name in CHASSIS else "powertrain")
)
ECU = EcuStatus(Authority.NONE, 0.1, 0.0, 0.5)


class Two:
    """A gateway on two buses that echo nothing; `chassis` has the number 0."""

    def __init__(self) -> None:
        self.chassis, self.powertrain, self.ring = Deaf(), Deaf(), Ring.local(1 << 12)
        self.gateway = Gateway(
            plan("throttle"), (self.chassis, self.powertrain), BINDING, self.ring, WHEELS
        )
        self.sender, self.number = Sender(BINDING.codec()), 0

    def tick(self, times: int = 1) -> None:
        for _ in range(times):
            self.number += 1
            self.gateway.tick(self.number, START + self.number * MILLISECOND)

    def ecu(self) -> can.Message:
        (frame,) = self.sender.frames(ECU)
        return can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=False)


@pytest.fixture
def two() -> Two:
    return Two()


def error(kind: int) -> can.Message:
    return can.Message(arbitration_id=kind, is_error_frame=True, data=bytes(8))


@pytest.mark.parametrize("failed", [False, True])
def test_each_frame_leaves_on_the_bus_of_its_message_only(two, failed):
    """Also the releases after an exception."""
    if failed:
        two.gateway.fail(ValueError("made by the test"), START, "in the test")
    two.tick(45)
    assert {frame.arbitration_id for frame in two.powertrain.sent} == {COMMAND}
    assert {frame.arbitration_id for frame in two.chassis.sent} == {STATUS}
    assert (len(two.powertrain.sent), len(two.chassis.sent)) == (45, 3)


def test_a_message_counts_on_its_own_bus_only(two):
    two.chassis.waiting = [two.ecu()]
    two.tick()
    assert two.gateway._monitor._received["EcuStatus"] == -math.inf
    two.powertrain.waiting = [two.ecu()]
    two.tick()
    assert two.gateway._monitor._received["EcuStatus"] > 0


def test_frames_are_recorded_with_the_number_of_their_bus(two):
    """Frames that the bench sends as well, where the bus does not echo them."""
    two.chassis.waiting, two.powertrain.waiting = [two.ecu()], [two.ecu()]
    two.tick(PATIENCE)
    seen = [(slot.bus, slot.identifier) for slot in two.ring.drain()]
    assert seen[:2] == [(0, two.ecu().arbitration_id), (1, two.ecu().arbitration_id)]
    assert set(seen[2:]) == {(1, COMMAND)}  # 3 statuses on the other bus are too few to know
    assert not any(frame.arbitration_id == COMMAND for frame in two.chassis.sent)


def test_the_own_command_is_another_benchs_on_no_other_bus_and_an_echo_on_its_own(two):
    two.tick()
    (sent,) = two.powertrain.sent
    two.chassis.waiting = [sent]
    two.tick()
    two.powertrain.waiting = [sent]
    two.tick()
    slots = [(slot.bus, bool(slot.flags & SENT)) for slot in two.ring.drain()]
    assert slots == [(0, False), (1, True)]
    assert two.gateway.state.trip is None
    two.powertrain.waiting = [sent]  # once more, from another bench
    two.tick()
    assert two.gateway.state.trip.reason == TripReason.TWO_SENDERS


def test_a_bus_that_refuses_counts_as_off_whatever_the_other_one_accepts(two):
    two.powertrain.fault = can.CanOperationError("no room")
    for _ in range(50):
        two.tick()
        assert two.gateway.refused
    assert two.gateway._bus_off()
    assert len(two.chassis.sent) == 3
    two.powertrain.fault = None
    two.tick()
    assert not two.gateway.refused
    assert not two.gateway._bus_off()
    two.chassis.fault = can.CanOperationError("gone")
    two.tick(OFF_THE_BUS)
    assert not two.gateway.refused  # the command leaves on the other one
    assert two.gateway._bus_off()


@pytest.mark.parametrize("off", ["chassis", "powertrain"])
def test_a_controller_that_is_off_stays_so_when_the_one_of_the_other_bus_restarts(two, off):
    other = "powertrain" if off == "chassis" else "chassis"
    getattr(two, off).waiting = [error(BUS_OFF_ERROR)]
    two.tick()
    getattr(two, other).waiting = [error(RESTARTED)]
    two.tick()
    assert two.gateway._bus_off()
    getattr(two, off).waiting = [error(RESTARTED)]
    two.tick()
    assert not two.gateway._bus_off()


@pytest.mark.parametrize("many", ["chassis", "powertrain"])
def test_too_many_frames_of_one_bus_leave_no_present_state(two, many):
    frames = [can.Message(arbitration_id=0x700, is_extended_id=False) for _ in range(MOST_FRAMES)]
    getattr(two, many).waiting = frames
    assert not two.gateway._listen(START * 1e-9), BEHIND


@pytest.mark.parametrize("broken", ["chassis", "powertrain"])
def test_after_an_exception_a_broken_bus_keeps_the_other_one_from_nothing(two, broken):
    other = "powertrain" if broken == "chassis" else "chassis"
    getattr(two, broken).fault = ZeroDivisionError("made by the test")
    getattr(two, other).waiting = [two.ecu()]
    two.tick(21)
    assert two.gateway.state.trip.reason == TripReason.INTERNAL_ERROR
    assert getattr(two, other).sent
    assert two.ecu().arbitration_id in {slot.identifier for slot in two.ring.drain()}


def test_as_many_buses_as_the_binding_names_are_needed():
    with pytest.raises(ValueError, match="zip"):
        Gateway(plan("throttle"), Deaf(), BINDING, Ring.local(64), WHEELS)

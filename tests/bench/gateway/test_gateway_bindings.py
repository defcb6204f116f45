"""Laws of the gateway on a bus that is not the bench's own: silence, assumed statuses, ages."""

from dataclasses import replace

import can
import pytest

from slipbench.bench.gateway.gateway import Gateway, _message
from slipbench.bench.loop.clock import SECOND
from slipbench.bench.loop.ring import Ring
from slipbench.protocol.codec.codec import Frame, Sender
from slipbench.protocol.codec.messages import ActuatorCommand, Authority, BenchMessage
from slipbench.protocol.codec.placement import SignalAt
from slipbench.protocol.database.layout import Message, Signal
from slipbench.protocol.recording.message_rules import Degraded
from tests.bench.gateway.test_gateway_tick_laws import Deaf
from tests.bench.gateway.test_receiver import BODY, ENGINE, PLACEMENT, Bus
from tests.bench.safety.world import MILLISECOND, START, WHEELS, plan

DEMAND = Message("Demand", 9, 4, (Signal("set", 0, 16, scale=0.01, unit="%"), Signal("on", 16, 2)))
THROTTLE = {"throttle": SignalAt("Demand", "set", to=""), "spark": 0.0, "time": 0.0}
WITH_AUTHORITY = {**THROTTLE, "authority": SignalAt("Demand", "on")}
WITHOUT = {**THROTTLE, "authority": Authority.NONE}
IN_WHEEL = {"speed": SignalAt("Wheel", "v", to="m/s")}
LATENCY = 0.003  # s


class Ridden:
    """A gateway on a bus with a request for the throttle.

    request: its fields; others: places of other messages
    """

    def __init__(
        self,
        request: dict,
        degraded: Degraded | None = None,
        timeouts: dict[str, float] | None = None,
        without: tuple[str, ...] = (),
        **others: dict,
    ) -> None:
        made = Bus(degraded, timeouts, without).binding
        binding = replace(
            made,
            database=replace(made.database, messages=(*made.database.messages, DEMAND)),
            placement={**made.placement, "ActuatorCommand": request, **others},
        )
        self.sender, self.bus = Sender(binding.codec()), Deaf()
        self.plan = plan("throttle")
        self.gateway = Gateway(self.plan, self.bus, binding, Ring.local(64), WHEELS)
        self.number = 0

    @property
    def now(self) -> float:
        return (START + self.number * MILLISECOND) / SECOND

    def tick(self, *messages: BenchMessage) -> None:
        """Put the frames of messages onto the bus, and run a tick."""
        for message in messages:
            self.bus.waiting += [heard(frame) for frame in self.sender.frames(message)]
        self.number += 1
        self.gateway.tick(self.number, START + self.number * MILLISECOND)


def heard(frame: Frame) -> can.Message:
    return can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=False)


@pytest.mark.parametrize("failed", [False, True])
@pytest.mark.parametrize(("request_", "frames"), [(WITHOUT, 0), (WITH_AUTHORITY, 5)])
def test_authority_is_released_by_a_frame_where_one_can_and_by_silence_elsewhere(
    failed, request_, frames
):
    """Also after an exception: a frame without a field for authority would be a request."""
    ridden = Ridden(request_)
    if failed:
        ridden.gateway.fail(ValueError("made by the test"), START, "in the test")
    for _ in range(5):
        ridden.tick()
        assert ridden.gateway.refused is False
    assert [message.arbitration_id for message in ridden.bus.sent] == [9] * frames


@pytest.mark.parametrize("failed", [False, True])
def test_a_release_that_the_bus_does_not_take_is_refused(failed):
    ridden = Ridden(WITH_AUTHORITY)
    if failed:
        ridden.gateway.fail(ValueError("made by the test"), START, "in the test")
    ridden.bus.fault = can.CanOperationError("made by the test")
    ridden.tick()
    assert ridden.gateway.refused is True
    ridden.bus.fault = None
    ridden.tick()
    assert ridden.gateway.refused is False


def test_an_assumed_status_of_the_ecu_is_new_at_every_tick_and_follows_the_requests():
    degraded = Degraded(hand_back="20 ms", echo=f"{LATENCY * 1e3} ms")
    ridden = Ridden(WITH_AUTHORITY, degraded, without=("EcuStatus",))
    ridden.tick(BODY)
    assert ridden.gateway._monitor._received["EcuStatus"] == ridden.now
    assert ridden.gateway._monitor.state(ridden.now).ecu.authority == Authority.NONE
    ridden.gateway._send(ActuatorCommand(Authority.THROTTLE, 0.25, 0.0, 0.0), ridden.now)
    ridden.bus.fault = can.CanOperationError("no later request is sent")
    granted = []
    for _ in range(5):
        ridden.tick()
        assert ridden.gateway._monitor._received["EcuStatus"] == ridden.now
        granted.append(ridden.gateway._monitor.state(ridden.now).ecu.authority)
    assert granted == [Authority.NONE] * 2 + [Authority.THROTTLE] * 3
    assert ridden.gateway._monitor.state(ridden.now).ecu.throttle_command == 0.25


def test_ages_are_measured_from_the_limit_of_the_trial_and_the_gear_is_its_gear():
    ridden = Ridden(WITH_AUTHORITY, Degraded(unmonitored=("gear",)), {"Body": 0.002})
    ridden.tick()
    before = ridden.now
    ridden.tick(BODY, ENGINE)
    shift = ridden.plan.trial.limits.stale - 0.002
    received = ridden.gateway._monitor._received
    assert shift > 0.001
    assert before - received["ThrottleStatus"] == pytest.approx(shift, abs=1e-6)
    assert received["EngineStatus"] == before
    gear = ridden.plan.trial.operating_point.gear
    assert gear != ENGINE.gear
    assert ridden.gateway._monitor.state(ridden.now).engine.gear == gear


@pytest.mark.parametrize("length", range(65))
def test_what_a_classic_frame_does_not_hold_is_sent_as_an_fd_frame(length):
    assert _message(Frame(9, bytes(length))).is_fd is (length > 8)


def test_a_faulty_frame_is_a_fault_of_each_message_in_it():
    ridden = Ridden(WITH_AUTHORITY, OpticalSpeed={**PLACEMENT["OpticalSpeed"], **IN_WHEEL})
    ridden.bus.waiting.append(heard(Frame(5, b"\0")))  # of two bytes
    ridden.tick()
    faults = ridden.gateway._monitor._faults
    assert {name for name, count in faults.items() if count} == {"FrontTeeth", "OpticalSpeed"}

"""Whether a frame moved an actuator that nothing allowed it to move: judged from the wire alone.

Written apart from the gateway, lookout, trial and permit, and importing nothing of them: it keeps
its own account of what each device last said rightly, and when. Limits are judged with the
resolution of the wire, so what it finds is a breach and not a rounding.
"""

import math
from typing import Any

import can

from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.faults import FrameFault
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    EncoderStatus,
    Intervals,
    OpticalSpeed,
    ToothIntervals,
)

RESOLUTION = {"throttle": 1.001e-4, "spark": math.radians(0.02002)}  # of the wire; 0..1 and rad
JUDGED = {
    "speed",
    "slip",
    "front_slip",
    "distance",
    "oldest_age",
    "engine.engine_speed",
    "rider.grip",
    "rider.front_brake",
    "rider.rear_brake",
    "rider.clutch",
}
SPOKEN = (
    "EcuStatus",
    "ThrottleStatus",
    "EngineStatus",
    "RiderControls",
    "OpticalSpeed",
    "RearTeeth",
    "FrontTeeth",
)


class Judge:
    """Hears every frame that the gateway can hear, and every frame that it sends."""

    def __init__(self, plan: Any, codec: Codec, wheels: Any) -> None:
        self.trial, self.authority = plan.trial, plan.authority
        self.actuator = "throttle" if plan.authority == Authority.THROTTLE else "spark"
        self.codec = codec
        self.pitch = {
            "RearTeeth": 2 * math.pi * wheels.rear_radius / wheels.teeth,
            "FrontTeeth": 2 * math.pi * wheels.front_radius / wheels.teeth,
        }
        self.said: dict[str, Any] = {}  # the last right message of each device
        self.when: dict[str, float] = {}  # s, when it came
        self.counters: dict[str, int] = {}
        self.stamps: dict[str, float] = {}
        self.faulty: set[str] = set()
        self.let_go = self.held = self.over = self.strange = False
        self.point = self.grip = math.nan  # opening and grip when the bench first held
        self.last: tuple[float, float, bool] | None = None  # s, value, with authority
        self.commands = 0

    # What the devices say

    def hear(self, frame: can.Message, now: float) -> None:
        """Take in a frame on its way to the gateway."""
        if frame.is_error_frame or frame.is_remote_frame or frame.is_extended_id:
            return
        message = self.codec.decode(frame.arbitration_id, frame.data)
        name = self.codec.name(frame.arbitration_id)
        if isinstance(message, FrameFault) or name is None:
            return
        if isinstance(message, EncoderStatus):
            self._trust(name.replace("EncoderStatus", "Teeth"), message.faulty)
        elif name in SPOKEN and self._is_news(name, frame.data[1] & 15, message):
            if isinstance(message, OpticalSpeed) and not message.valid:
                return
            self.said[name], self.when[name] = message, now
            self.let_go |= name == "RiderControls" and not message.button

    def _trust(self, name: str, faulty: bool) -> None:
        (self.faulty.add if faulty else self.faulty.discard)(name)

    def _is_news(self, name: str, counter: int, message: Any) -> bool:
        repeated = self.counters.get(name) == counter
        self.counters[name] = counter
        if repeated or name in self.faulty:
            return False
        stamp = getattr(message, "time", getattr(message, "tooth_count", None))
        if isinstance(message, ToothIntervals) and message.layout == Intervals.STANDING:
            return True
        stands = stamp is not None and self.stamps.get(name) == stamp
        self.stamps[name] = stamp
        return not stands

    def sees_strangely(self, what: tuple[str, float] | None) -> None:
        """Know that the gateway will take a number for not a number in the coming tick."""
        self.strange = what is not None and what[0] in JUDGED and math.isnan(what[1])

    # What the gateway does

    def look(self, sent: list[can.Message], due: int, refused: bool) -> None:
        """Judge everything that the gateway sent in the tick that was due at `due` (ns)."""
        commands = [
            message
            for frame in sent
            if isinstance(
                message := self.codec.decode(frame.arbitration_id, frame.data), ActuatorCommand
            )
        ]
        assert len(commands) == (0 if refused else 1), "one heartbeat a tick"
        for command in commands:
            self._judge(command, due * 1e-9, due)

    def _judge(self, command: ActuatorCommand, now: float, due: int) -> None:
        unasked = [
            name
            for name, bit in (("throttle", Authority.THROTTLE), ("spark", Authority.SPARK))
            if not command.authority & bit and getattr(command, name) != 0.0
        ]
        assert unasked == [], "moves what it has no authority over"
        value = getattr(command, self.actuator)
        if command.authority == Authority.NONE:
            self.over |= self.held
            self.last = due, value, False
            return
        assert command.authority == self.authority, "asks for more than the trial needs"
        assert not self.over, "takes authority again after it went back"
        against = self.reasons(now)
        assert not against, against
        self._within_limits(value, due)
        self.last = due, value, True
        self.commands += 1

    def reasons(self, now: float) -> list[str]:
        """Say why nobody may hold authority now, by what the devices said."""
        limits, said = self.trial.limits, self.said
        if set(said) != set(SPOKEN):
            return ["not all devices were heard"]
        rider, engine = said["RiderControls"], said["EngineStatus"]
        speed = said["OpticalSpeed"].speed
        old = [
            n for n in SPOKEN if not -1e-6 <= now - self.when.get(n, -1e9) <= limits.stale + 1e-6
        ]
        checks = {
            f"stale: {old}": old,
            "a number that is none": self.strange,
            "the button": not (rider.button and self.let_go),
            "a brake": max(rider.front_brake, rider.rear_brake) >= limits.brake_pressure,
            "the clutch": rider.clutch >= limits.clutch,
            "a closed grip": rider.grip <= limits.grip_closed,
            "the gear": engine.gear != self.trial.operating_point.gear,
            "engine speed": outside(engine.engine_speed, limits.engine_speed),
            "speed": outside(speed, limits.speed),
            "a throttle body's fault": said["ThrottleStatus"].faulty,
            "slip": self._slips("RearTeeth", speed, limits.slip),
            "front slip": self._slips("FrontTeeth", speed, limits.front_slip),
        }
        return [reason for reason, holds in checks.items() if holds]

    def _slips(self, name: str, speed: float, limit: float) -> bool:
        teeth = self.said[name]
        if teeth.layout == Intervals.STANDING:
            return False  # the lookout's own estimate; test_lookout.py judges it
        turned = self.pitch[name] * len(teeth.intervals) / sum(teeth.intervals)
        return not abs(turned / speed - 1.0) <= limit + 1e-6

    def _within_limits(self, value: float, due: int) -> None:
        limits, fine = self.trial.limits, RESOLUTION[self.actuator]
        throttle = self.actuator == "throttle"
        low, high = limits.throttle if throttle else limits.spark
        assert low - fine <= value <= high + fine, "outside the range"
        assert self.last is not None, "the first command of all asks for authority"
        before, from_, holding = self.last
        if not self.held:
            self.held = True
            self.point = self.said["EcuStatus"].throttle_command
            self.grip = self.said["RiderControls"].grip
        start = from_ if holding else (self.point if throttle else 0.0)
        elapsed = (due - before) * 1e-9
        rate = limits.throttle_rate if throttle else limits.spark_rate
        assert 0 < elapsed <= self.trial.command.silence + 2e-6, "goes on after a pause"
        assert abs(value - start) <= rate * elapsed + 2 * fine, "moves too fast"
        if throttle:
            most = limits.throttle_deviation
            assert abs(value - self.point) <= most + 2 * fine, "too far off the operating point"
            hand = self.said["RiderControls"].grip
            assert abs(hand - self.grip) <= most + 1e-6, "goes on though the rider's hand moved"

    def expect_held(self) -> None:
        """Fail where nothing was ever held: a judge of nothing finds nothing."""
        assert self.held
        assert self.commands > 0


def outside(value: float, bounds: tuple[float, float]) -> bool:
    """Tell of a value that is clearly beyond its bounds."""
    return not bounds[0] - 1e-6 <= value <= bounds[1] + 1e-6

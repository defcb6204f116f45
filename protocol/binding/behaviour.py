"""Behaviour of the signals of a capture: plausible values, agreeing speeds, gear ratios."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from slipbench.protocol.binding.capture import Captured
from slipbench.protocol.binding.gear_ratios import SLOW, correlation, explained_ratio, stepped
from slipbench.protocol.binding.match import SWITCHES, Match, match, suits_unit, unit_concepts
from slipbench.protocol.database.layout import Message, Signal
from slipbench.protocol.recording.roles import ROLES
from slipbench.protocol.units import linear

Array = npt.NDArray[np.float64]

STEP = 0.1  # s, of the common time base
AGREES = 0.985  # correlation from which two speeds are the same motion
DISAGREES = 0.7
STEPPED = 0.75  # share of the samples in those ratios from which a speed is that of the engine

# Values that a role can have, SI; with a margin, for any motorcycle or car.
PLAUSIBLE: dict[str, tuple[float, float]] = {
    "engine_speed": (0.0, 2100.0),
    "gear": (-2.0, 15.0),
    "throttle_position": (-0.1, 1.1),
    "throttle_command": (-0.1, 1.1),
    "throttle_request": (-0.1, 1.1),
    "rider_grip": (-0.1, 1.1),
    "spark_advance": (-1.1, 1.4),
    "coolant_temperature": (233.0, 410.0),
    "intake_temperature": (233.0, 410.0),
    "manifold_pressure": (0.0, 5e5),
    "front_brake_pressure": (-3e5, 3e7),
    "rear_brake_pressure": (-3e5, 3e7),
    "longitudinal_acceleration": (-25.0, 25.0),
    "lateral_acceleration": (-25.0, 25.0),
    "yaw_rate": (-7.0, 7.0),
    "pitch_rate": (-7.0, 7.0),
    "lean_angle": (-1.3, 1.3),
}
BY_BEHAVIOUR = ("engine_speed", "gear", "vehicle_speed")
NAMED = 0.25  # score from which the name of a signal is evidence
BEHAVES = 0.6  # score of a signal that only its behaviour speaks for
MOST_OF_SWITCH = 4  # values
SPEED = (-6.0, 130.0)
SPEED_ROLES = tuple(role for role in ROLES if role.endswith("_speed") and role != "engine_speed")


@dataclass(frozen=True)
class Evidence:
    """Evidence of a capture on a signal in a role: a change of the score, and the reason."""

    change: float
    reason: str


class Behaviour:
    """Evidence from one capture."""

    def __init__(self, capture: Captured) -> None:
        """Prepare; each signal is resampled at its first use."""
        self.capture = capture
        steps = int(capture.duration / STEP)
        self._base = np.arange(max(steps, 1)) * STEP
        self._held: dict[str, Array | None] = {}

    def evidence(self, found: Match, role: str) -> list[Evidence]:
        """Evidence of the capture on a signal in a role."""
        if found.message.name not in self.capture.traffic:
            return [Evidence(-0.5, "message not in the capture")]
        return list(self._evidence(found, role))

    def _evidence(self, found: Match, role: str) -> Iterator[Evidence]:
        values = self.on_base(found, role)
        if values is None:
            yield Evidence(-0.1, "no samples in the capture")
            return
        low, high = SPEED if role in SPEED_ROLES else PLAUSIBLE.get(role, (-np.inf, np.inf))
        outside = float(np.mean((values < low) | (values > high)))
        if outside > 0.02:
            yield Evidence(-0.4, f"{outside:.0%} of the values are not plausible")
        if np.ptp(values) == 0:
            yield Evidence(-0.05, "constant in the capture")
            return
        if role in SPEED_ROLES:
            yield from self._same_motion(found, values)
        if role == "engine_speed":
            yield from self._steps(values)
        if role == "gear":
            yield from self._explains_ratio(values)
        if role in SWITCHES and (count := np.unique(values).size) > MOST_OF_SWITCH:
            yield Evidence(-0.4, f"no switch: {count} different values")

    def _same_motion(self, found: Match, values: Array) -> Iterator[Evidence]:
        if self.speed is None or found.name == self.speed[0]:
            return
        name, speed = self.speed
        agreed = correlation(values, speed)
        if agreed >= AGREES:
            yield Evidence(0.1, f"agrees with {name} (correlation {agreed:.3f})")
        elif agreed < DISAGREES:
            yield Evidence(-0.15, f"disagrees with {name} (correlation {agreed:.2f})")

    def _steps(self, values: Array) -> Iterator[Evidence]:
        if self.speed is None:
            return
        share, ratios = stepped(values, self.speed[1])
        if share >= STEPPED and len(ratios) > 1:
            yield Evidence(
                0.15,
                f"over {self.speed[0]} it steps between {len(ratios)} gear ratios ({share:.0%})",
            )

    def _explains_ratio(self, values: Array) -> Iterator[Evidence]:
        if self.speed is None or self.engine is None:
            return
        explained = explained_ratio(values, self.engine[1], self.speed[1])
        if explained >= 0.8:
            yield Evidence(0.15, f"explains {explained:.0%} of the ratio of engine and wheel speed")

    def unnamed(self, role: str) -> Iterator[Match]:
        """Signals whose names do not indicate a role, but which behave as it does."""
        if self.speed is None or role not in BY_BEHAVIOUR:
            return
        for message, signal in self._numbers():
            found = Match(message, signal, 0.0, ())
            if found.name == self.speed[0] and role != "vehicle_speed":
                continue
            if not suits_unit(signal, role) or _is_named(message, signal, role):
                continue
            values = self.on_base(found, role)
            if values is not None and np.ptp(values) > 0:
                for each in self._shows(found, role, values):
                    yield Match(message, signal, BEHAVES, ("by behaviour alone", each.reason))

    def _shows(self, found: Match, role: str, values: Array) -> Iterator[Evidence]:
        """Evidence that is enough for a role without a name."""
        match role:
            case "engine_speed":
                yield from self._steps(values)
            case "gear":
                yield from self._explains_ratio(values)
            case _:
                yield from (each for each in self._same_motion(found, values) if each.change > 0)

    def _numbers(self) -> Iterator[tuple[Message, Signal]]:
        """Signals of the capture that are numbers of more than one bit, without selectors."""
        for message in self.capture.database.messages:
            if message.name in self.capture.traffic:
                for signal in message.signals:
                    if signal.length > 2 and not (signal.is_multiplexer or signal.multiplexer):
                        yield message, signal

    @cached_property
    def speed(self) -> tuple[str, Array] | None:
        """Name and series (m/s) of the speed with which the other speeds agree best.

        Of the signals called speeds; where there is none, of all whose unit is that of a speed.
        """
        called = [(m, s, role) for m, s, role in self._called(SPEED_ROLES)]
        by_unit = [
            (message, signal, "vehicle_speed")
            for message, signal in self._numbers()
            if "speed" in unit_concepts(signal.unit)
        ]
        for candidates in (called, by_unit):
            if found := dict(self._speeds(candidates)):
                names = list(found)
                support = {
                    one: sum(correlation(found[one], found[other]) > AGREES for other in names)
                    for one in names
                }
                best = max(names, key=lambda one: (support[one], -names.index(one)))
                return best, found[best]
        return None

    def _speeds(self, candidates: list[tuple[Message, Signal, str]]) -> Iterator[tuple[str, Array]]:
        for message, signal, role in candidates:
            values = self.on_base(Match(message, signal, 0.0, ()), role)
            if values is not None and np.ptp(values) > SLOW and (values < SPEED[1]).all():
                yield f"{message.name}.{signal.name}", values

    @cached_property
    def engine(self) -> tuple[str, Array] | None:
        """Name and series of the engine speed: the one best called so, else the one that steps."""
        called = [match(m, s, r) for m, s, r in self._called(("engine_speed",))]
        for found in sorted(called, key=lambda each: -each.score):
            values = self.on_base(found, "engine_speed")
            if values is not None and np.ptp(values) > 0:
                return found.name, values
        for message, signal in self._numbers():
            found = Match(message, signal, 0.0, ())
            values = self.on_base(found, "engine_speed")
            if values is None or "rpm" not in unit_concepts(signal.unit):
                continue
            if any(self._steps(values)):
                return found.name, values
        return None

    def _called(self, roles: tuple[str, ...]) -> Iterator[tuple[Message, Signal, str]]:
        """Signals in the capture whose names suit one of the roles."""
        for message in self.capture.database.messages:
            if message.name not in self.capture.traffic:
                continue
            for signal in message.signals:
                best = max(roles, key=lambda role: match(message, signal, role).score)
                if match(message, signal, best).score >= 0.55 and suits_unit(signal, best):
                    yield message, signal, best

    def on_base(self, found: Match, role: str) -> Array | None:
        """Values on the common time base, SI where the unit converts; None without samples."""
        key = f"{found.name}:{ROLES[role].unit}"
        if key not in self._held:
            times, values = self.capture.series(found.message, found.signal)
            good = np.isfinite(values)
            if np.count_nonzero(good) < 2:
                self._held[key] = None
            else:
                slope, zero = _to_si(found.signal.unit, ROLES[role].unit)
                held = np.interp(self._base, times[good], values[good])
                self._held[key] = slope * held + zero
        return self._held[key]


def _is_named(message: Message, signal: Signal, role: str) -> bool:
    """Whether the name of a signal identifies it: this role, or for a speed another speed."""
    roles = SPEED_ROLES if role in SPEED_ROLES else (role,)
    return any(match(message, signal, each).score >= NAMED for each in roles)


def _to_si(unit: str, target: str) -> tuple[float, float]:
    for si in (target, "rad/s"):
        try:
            return linear(unit, si)
        except ValueError:
            continue
    return 1.0, 0.0

"""How the signals of a capture behave: plausible values, agreeing speeds, gears in the ratio of speeds."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from slipbench.protocol.binding.capture import Captured
from slipbench.protocol.binding.match import Match, match, suits_unit
from slipbench.protocol.database.layout import Message, Signal
from slipbench.protocol.recording.roles import ROLES
from slipbench.protocol.units import linear

Array = npt.NDArray[np.float64]

STEP = 0.1  # s, of the common time base
SLOW = 3.0  # m/s, below which a ratio of speeds is not formed
AGREES = 0.985  # correlation from which two speeds are the same motion
DISAGREES = 0.7
GEARS = 7  # ratios that are looked for
WIDTH = 0.02  # of one ratio, relative, to either side
STEPPED = 0.75  # share of the samples in those ratios from which a speed is that of the engine
FEWEST = 30  # samples on the common time base from which anything is concluded

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
SPEED = (-6.0, 130.0)
SPEED_ROLES = tuple(role for role in ROLES if role.endswith("_speed") and role != "engine_speed")


@dataclass(frozen=True)
class Evidence:
    """What a capture says of a signal in a role: it changes the score, for a reason."""

    change: float
    reason: str


class Behaviour:
    """Evidence from one capture."""

    def __init__(self, capture: Captured) -> None:
        """Prepare; each signal is resampled when it is first asked for."""
        self.capture = capture
        steps = int(capture.duration / STEP)
        self._base = np.arange(max(steps, 1)) * STEP
        self._held: dict[str, Array | None] = {}

    def evidence(self, found: Match, role: str) -> list[Evidence]:
        """What the capture says of a signal in a role."""
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

    @cached_property
    def speed(self) -> tuple[str, Array] | None:
        """Name and series (m/s) of the speed with which the other speeds agree best."""
        found: dict[str, Array] = {}
        for message, signal, role in self._called(SPEED_ROLES):
            values = self.on_base(Match(message, signal, 0.0, ()), role)
            if values is not None and np.ptp(values) > SLOW and (values < SPEED[1]).all():
                found.setdefault(f"{message.name}.{signal.name}", values)
        if not found:
            return None
        names = list(found)
        support = {
            one: sum(correlation(found[one], found[other]) > AGREES for other in names)
            for one in names
        }
        best = max(names, key=lambda one: (support[one], -names.index(one)))
        return best, found[best]

    @cached_property
    def engine(self) -> tuple[str, Array] | None:
        """Name and series of the signal that is best called engine speed."""
        called = sorted(
            (match(m, s, r) for m, s, r in self._called(("engine_speed",))),
            key=lambda each: -each.score,
        )
        for found in called:
            values = self.on_base(found, "engine_speed")
            if values is not None and np.ptp(values) > 0:
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


def correlation(one: Array, other: Array) -> float:
    """Correlation of two series, (n,) each; 0 where one is constant."""
    if one.size < FEWEST or np.ptp(one) == 0 or np.ptp(other) == 0:
        return 0.0
    return float(np.corrcoef(one, other)[0, 1])


def stepped(engine: Array, speed: Array) -> tuple[float, list[float]]:
    """Share of the samples whose ratio engine / speed lies at one of a few values, and those values.

    engine: rad/s, speed: m/s, (n,) each. Only ratios that hold at least 4 % of the samples count.
    """
    moving = (speed > SLOW) & (engine > 0)
    if np.count_nonzero(moving) < FEWEST:
        return 0.0, []
    logs = np.sort(np.log(engine[moving] / speed[moving]))
    total, inside, found = logs.size, 0, []
    for _ in range(GEARS):
        if not logs.size:
            break
        ends = np.searchsorted(logs, logs + 2 * WIDTH, side="right")
        counts = ends - np.arange(logs.size)
        first = int(counts.argmax())
        if counts[first] < 0.04 * total:
            break
        found.append(float(np.exp(np.median(logs[first : ends[first]]))))
        inside += int(counts[first])
        logs = np.concatenate([logs[:first], logs[ends[first] :]])
    return inside / total, found


def explained_ratio(gear: Array, engine: Array, speed: Array) -> float:
    """Share of the variance of log(engine / speed) that the values of a gear explain. (n,) each."""
    moving = (speed > SLOW) & (engine > 0) & (gear == np.round(gear))
    values = np.unique(gear[moving])
    if np.count_nonzero(moving) < FEWEST or not 2 <= values.size <= 10:
        return 0.0
    logs, gears = np.log(engine[moving] / speed[moving]), gear[moving]
    within = sum(
        float(((logs[gears == v] - np.median(logs[gears == v])) ** 2).sum()) for v in values
    )
    total = float(((logs - logs.mean()) ** 2).sum())
    return 1.0 - within / total if total > 0 else 0.0


def _to_si(unit: str, target: str) -> tuple[float, float]:
    for si in (target, "rad/s"):
        try:
            return linear(unit, si)
        except ValueError:
            continue
    return 1.0, 0.0

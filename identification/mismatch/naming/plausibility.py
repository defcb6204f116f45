"""Which of several names that recordings cannot tell apart leads the verdict.

Each prior is a statement about vehicles and benches that needs no recording, with its reason. It
never decides against evidence: only names within the margin of a tie are put in order, and all of
them stay listed, with the reason against them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.curves.trace import regressors
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.simulation.sensor import Sensor
from slipbench.identification.signals.clocks import BUS
from slipbench.plant.signals import Floats

DRIFT = 1e-3
"""Clock drift that no clock of a device has: a CAN node with more loses the bit timing of its bus."""
AT_REST = 0.25
"""Share of an offset above which a reading at rest counts as off."""
REST = 0.5
"""Seconds for which a reading must stand near zero to be at rest."""
HELD = 0.5
"""Share of bins in which a computed input keeps its value."""
SENSORS = ("optical_sensor", "encoder", "channel")
"""Blocks of the motorcycle that only report."""
OF_A_READING = ("offset", "scale", "reversed_sign")
"""Effects at an input that say that it was recorded wrongly."""


@dataclass(frozen=True)
class Prior:
    """A reason against names. rank: how much it weighs; doubts: whether it is against an effect."""

    reason: str
    rank: int
    doubts: Callable[[Candidate, Fit], bool]


def doubts(candidate: Candidate, fit: Fit) -> list[Prior]:
    """List the priors against an effect, the heaviest first."""
    return [p for p in PRIORS if p.doubts(candidate, fit)]


def rank(fit: Fit, beside: int) -> int:
    """Weight of the priors against what a fit has more than so many effects; 0: none."""
    news = [c for c in fit.candidates[beside:] if isinstance(c, Candidate)]
    return max((p.rank for c in news for p in doubts(c, fit)), default=0)


def plausible_first(fits: Sequence[Fit], beside: int, margin: float) -> list[Fit]:
    """Put the most plausible first among fits, best first, that are tied with the best.

    beside: effects that all of them share; margin: nats of a tie.
    """
    if not fits:
        return []
    number = len(fits[0].candidates)

    def tied(fit: Fit) -> bool:
        return fits[0].score - fit.score < margin and len(fit.candidates) == number

    ties = [f for f in fits if tied(f)]
    return [*sorted(ties, key=lambda f: rank(f, beside)), *(f for f in fits if not tied(f))]


def _kind_of_place(candidate: Candidate) -> str:
    return str(getattr(getattr(candidate.kind, "place", None), "kind", ""))


def _of_a_sensor(candidate: Candidate, _: Fit) -> bool:
    return candidate.kind.block in SENSORS or _kind_of_place(candidate) == "output"


def _sensors(candidate: Candidate, fit: Fit) -> list[Sensor]:
    subject = candidate.pattern.subject.partition("/")[0]
    return [r.sensors[subject] for r in fit.model.records if subject in r.sensors]


def _of_the_one_clock(candidate: Candidate, fit: Fit) -> bool:
    sensors = _sensors(candidate, fit)
    return _of_a_clock(candidate) and bool(sensors) and all(s.clock == BUS for s in sensors)


def _of_a_clock(candidate: Candidate) -> bool:
    return candidate.kind.name in ("clock_offset", "clock_drift")


def _too_fast(candidate: Candidate, _: Fit) -> bool:
    if candidate.kind.name != "clock_drift":
        return False
    effect = candidate.effect()
    return any(abs(getattr(effect, p.name)) > DRIFT for p in candidate.kind.parameters())


def _not_at_rest(candidate: Candidate, fit: Fit) -> bool:
    if candidate.kind.name != "offset" or _kind_of_place(candidate) != "output":
        return False
    offset = abs(float(getattr(candidate.effect(), candidate.kind.parameters()[0].name)))
    return any(_rests(s, AT_REST * offset) for s in _sensors(candidate, fit))


def _rests(sensor: Sensor, near: float) -> bool:
    """Whether a sensor reads nothing for some time."""
    count = max(round(REST / sensor.grid.width), 2)
    quiet: Floats = (sensor.known & (np.abs(sensor.value) < near)).astype(float)
    return bool(quiet.size >= count and np.convolve(quiet, np.ones(count), "valid").max() >= count)


def _leak_of_a_speed(candidate: Candidate, _: Fit) -> bool:
    """Tell whether a speed is said to leak: the unit of its rate is one of an acceleration."""
    unit = str(getattr(getattr(candidate.kind, "place", None), "unit", ""))
    return candidate.kind.name == "linear_loss" and unit.endswith("/s/s")


def _of_a_computed_input(candidate: Candidate, fit: Fit) -> bool:
    if _kind_of_place(candidate) != "input" or candidate.kind.name not in OF_A_READING:
        return False
    name = candidate.pattern.subject.partition("/")[0].replace("_", " ")
    subsystem = next(iter(fit.model.partition.subsystems))
    return all(
        _held(record.grid.binned(regressors(fit, subsystem, r)[name]))
        for r, record in enumerate(fit.model.records)
    )


def _held(bins: Floats) -> bool:
    """Whether most bins repeat the one before, as no measurement does."""
    return bool(np.mean(np.abs(np.diff(bins)) <= 1e-9 * np.ptp(bins)) > HELD)


PRIORS = (
    Prior("all channels of this recording share one clock", 3, _of_the_one_clock),
    Prior("no clock drifts by more than 1e-3", 3, _too_fast),
    Prior("an offset of the sensor would be seen at rest, where it reads zero", 3, _not_at_rest),
    Prior("a computed input does not err", 2, _of_a_computed_input),
    Prior("a speed is lost to friction, not by leakage", 1, _leak_of_a_speed),
    Prior("a fault of a sensor is rarer than physics that explains as much", 1, _of_a_sensor),
)

"""Places at which a parameter changes suddenly, with a stated rate of false alarms.

A series that is constant, or changes linearly, is said to have a change point with a probability of at
most LEVEL. At each place with two values or more on either side, a step is added to the line, and an F
test compares the two; the p-values are multiplied by the number of places (Bonferroni). The test needs
the intervals to be right up to a common factor, or up to a scatter between runs (`variances`). After
a place was found, the next one is looked for beside it at the same level.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import stats

from slipbench.identification.season.weighted import Fit, fit, variances
from slipbench.protocol.recording.channel import FloatArray

LEVEL = 0.05
BESIDE = 2  # values on either side of a step: one value alone may be an outlier

ROUNDING = 1e-9  # of the values: residuals below are those of the arithmetic


@dataclass(frozen=True)
class ChangePoint:
    """A step between two neighbouring values.

    after      index of the first value after it
    p_value    of so large a step without a change, over all places
    before, afterwards  level on either side: estimate, low and high of the 95 % interval
    also       the same index for other places, where the step fits hardly worse
    """

    after: int
    p_value: float
    before: tuple[float, float, float]
    afterwards: tuple[float, float, float]
    also: tuple[int, ...] = ()

    @property
    def rises(self) -> bool:
        """Whether the level is higher afterwards."""
        return self.afterwards[0] > self.before[0]


def change_points(
    x: FloatArray, value: FloatArray, deviation: FloatArray
) -> tuple[ChangePoint, ...]:
    """Sudden changes of values over x, in their order.

    x: (n,), increasing, any unit; value, deviation: (n,) in one unit, deviation 0 where it is unknown
    """
    steps: list[tuple[int, float]] = []
    while found := _next(x, value, deviation, [at for at, _ in steps]):
        steps.append(found)
    steps.sort()
    places = [at for at, _ in steps]
    return tuple(_described(x, value, deviation, places, at, p) for at, p in steps)


def _next(
    x: FloatArray, value: FloatArray, deviation: FloatArray, known: list[int]
) -> tuple[int, float] | None:
    """The most significant further step and its p-value; None where there is none."""
    places = _places(x.size, known)
    base = model(x, known)
    if not places or x.size - base.shape[1] < 2:
        return None
    if np.sqrt(fit(base, value, np.ones_like(value)).residual) <= ROUNDING * np.linalg.norm(value):
        return None
    variance, between = variances(base, value, deviation)
    without = fit(base, value, variance)
    steps = {at: fit(model(x, [*known, at]), value, variance) for at in places}
    at = min(places, key=lambda one: steps[one].residual)
    freedom = steps[at].freedom - (between > 0)  # the scatter was estimated, too
    p = min(len(places) * _p_value(without, steps[at], freedom), 1.0)
    return (at, p) if p < LEVEL else None


def _places(count: int, known: list[int]) -> list[int]:
    ends = sorted([0, *known, count])
    return [at for a, b in pairwise(ends) for at in range(a + BESIDE, b - BESIDE + 1)]


def model(x: FloatArray, steps: list[int]) -> FloatArray:
    """Columns of a line with steps: shape (n, 2 + number of steps). x: any unit"""
    span = np.ptp(x) or 1.0
    index = np.arange(x.size)
    return np.column_stack(
        [np.ones_like(x), (x - x.mean()) / span, *((index >= at).astype(float) for at in steps)]
    )


def _p_value(without: Fit, step: Fit, freedom: int) -> float:
    """Probability of so large a reduction of the residual by one column without any effect."""
    gained = without.residual - step.residual
    if freedom < 1:
        return 1.0
    if step.residual <= 0:
        return 0.0 if gained > 0 else 1.0
    return float(stats.f.sf(gained / step.residual * freedom, 1, freedom))


def _described(
    x: FloatArray, value: FloatArray, deviation: FloatArray, places: list[int], at: int, p: float
) -> ChangePoint:
    columns = model(x, places)
    variance, _ = variances(columns, value, deviation)
    made = fit(columns, value, variance)
    others = [one for one in places if one != at]
    alternatives = {
        one: fit(model(x, [*others, one]), value, variance) for one in _places(x.size, others)
    }
    near = float(stats.f.ppf(1 - LEVEL, 1, made.freedom)) * max(made.scale, 1.0)
    also = [k for k, one in alternatives.items() if k != at and one.residual - made.residual < near]
    before, afterwards = level(made, columns[at - 1]), level(made, columns[at])
    return ChangePoint(at, p, before, afterwards, tuple(also))


def level(of: Fit, row: FloatArray) -> tuple[float, float, float]:
    """Value of a model at a row of columns, and its 95 % interval. row: (p,), no unit"""
    value = float(row @ of.coefficients)
    deviation = np.sqrt(row @ of.covariance @ row * max(of.scale, 1.0))
    half = float(stats.t.ppf(0.975, of.freedom) * deviation)
    return value, value - half, value + half

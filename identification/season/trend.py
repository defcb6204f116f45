"""Trend of a parameter: a line with its interval, and sudden changes."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from slipbench.identification.season.change_points import ChangePoint, change_points, level, model
from slipbench.identification.season.points import Points
from slipbench.identification.season.weighted import Fit, fit, variances
from slipbench.protocol.recording.channel import FloatArray


@dataclass(frozen=True)
class Trend:
    """A line through the points, weighted by their intervals.

    change      over the whole abscissa: estimate, low and high of the 95 % interval
    p_value     of so large a slope without any
    scatter     standard deviation between runs that the intervals do not explain, unit of the values
    changes     sudden changes beside the line
    """

    points: Points
    change: tuple[float, float, float]
    p_value: float
    scatter: float
    changes: tuple[ChangePoint, ...]

    @property
    def significant(self) -> bool:
        """Whether the interval of the change excludes 0."""
        return self.p_value < 0.05


def trend(of: Points) -> Trend:
    """Weighted linear trend and change points of a parameter; at least three points.

    The interval of the trend is that of the t distribution, with the scatter between runs in it.
    """
    line = model(of.x, [])
    variance, between = variances(line, of.value, of.deviation)
    made = fit(line, of.value, variance)
    change, deviation = float(made.coefficients[1]), _deviation(made)
    half = float(stats.t.ppf(0.975, made.freedom)) * deviation
    p_value = float(2 * stats.t.sf(abs(change) / deviation, made.freedom)) if deviation else 1.0
    scatter = float(np.sqrt(between if of.deviation.any() else variance[0]))
    return Trend(
        of,
        (change, change - half, change + half),
        p_value,
        scatter,
        change_points(of.x, of.value, of.deviation),
    )


def _deviation(made: Fit) -> float:
    """Standard deviation of the slope; intervals that are too wide do not narrow it."""
    return float(np.sqrt(made.covariance[1, 1] * max(made.scale, 1.0)))


def curve(of: Trend) -> FloatArray:
    """The line with its steps at each point, and its 95 % interval: shape (n, 3), unit of the values."""
    x, value, deviation = of.points.x, of.points.value, of.points.deviation
    columns = model(x, [one.after for one in of.changes])
    made = fit(columns, value, variances(columns, value, deviation)[0])
    return np.array([level(made, row) for row in columns])

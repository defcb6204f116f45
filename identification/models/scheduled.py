"""A linear model whose parameters are smooth functions of speed, from trials at several speeds.

All trials are fitted at once. With x = ln(v / v_0), gain, pole and driveline resonance follow
polynomials in x (logarithms, so that they stay positive); what belongs to the actuator, its
resonance and the dead time, does not depend on the speed. One gear: another gear is another
inertia.

    fit = fit_scheduled([Trial(speed, response) for ...])     # ScheduledFit or NoSchedule
    fit.at(48.0)                                              # a linear model, SwitchedModel
    fit.parameter("frequency 1", 48.0)                        # value, half width of 95 %
    leave_one_out(trials)                                     # errors at held-out speeds
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy import stats
from scipy.optimize import OptimizeResult, least_squares

from slipbench.identification.models.switched import Direction, SwitchedModel
from slipbench.identification.response.independent_lines import NoRational, independent_lines
from slipbench.identification.response.response import ComplexArray, FrequencyResponse
from slipbench.protocol.recording.channel import FloatArray

FEWEST = 3  # speeds; with two of them a slope could not be tested
NAMES = ("gain", "pole", "zero", "frequency 1", "damping 1", "frequency 2", "damping 2", "delay")
DEGREES = (2, 1, 0, 1, 1, 0, 0, 0)  # of the polynomials in ln(v / v_0)
LOGARITHMIC = np.array([True, True, False, True, True, True, True, False])
LOW = np.array(
    [-np.inf, np.log(2e-4), -0.3, np.log(6.0), np.log(0.02), np.log(6.0), np.log(0.02), 0.0]
)
HIGH = np.array([np.inf, 0.0, 0.3, np.log(250.0), np.log(1.5), np.log(600.0), np.log(1.5), 0.06])
ACCURACY = 0.005  # of the gain; interpolation and filters are not better


@dataclass(frozen=True)
class Trial:
    """A frequency response that was measured at one speed, m/s."""

    speed: float
    response: FrequencyResponse


@dataclass(frozen=True)
class ScheduledFit:
    """Parameters as polynomials in ln(v / centre).

    coefficient  of each of NAMES in turn, lowest power first, (c,); logarithms but zero and delay
    covariance   (c, c); degrees: of the polynomials; quantile: two-sided 95 %
    low, high    m/s, between which it was fitted
    chi_square_ratio  per degree of freedom; 1 where only noise is left
    """

    coefficient: FloatArray
    covariance: FloatArray
    degrees: tuple[int, ...]
    centre: float
    low: float
    high: float
    quantile: float
    chi_square_ratio: float

    def at(self, speed: float) -> SwitchedModel:
        """Linear model at a speed, m/s; beyond the trials it is the one at their end."""
        return _model(_raw(self.coefficient, self.degrees, self._x(speed)))

    def parameter(self, name: str, speed: float) -> tuple[float, float]:
        """Value of a parameter at a speed and the half width of its 95 % interval, SI."""
        i = NAMES.index(name)
        row = np.zeros(self.coefficient.size)
        row[_own(self.degrees, i)] = self._x(speed) ** np.arange(self.degrees[i] + 1)
        value, deviation = row @ self.coefficient, np.sqrt(row @ self.covariance @ row)
        if not LOGARITHMIC[i]:
            return float(value), float(self.quantile * deviation)
        return float(np.exp(value)), float(np.exp(value) * self.quantile * deviation)

    def _x(self, speed: float) -> float:
        return float(np.log(np.clip(speed, self.low, self.high) / self.centre))


@dataclass(frozen=True)
class NoSchedule:
    """Why there is no model over speed."""

    reason: str


@dataclass(frozen=True)
class LeftOutSpeed:
    """One speed predicted from the others: error of the scheduled model, and of one for all speeds.

    speed: m/s; errors: root of the squared error over the squared response, 1
    """

    speed: float
    scheduled: float
    constant: float


def fit_scheduled(
    trials: Sequence[Trial], degrees: tuple[int, ...] = DEGREES
) -> ScheduledFit | NoSchedule:
    """Fit one model to responses at several speeds."""
    speeds = np.array([trial.speed for trial in trials])
    if len(trials) < FEWEST:
        return NoSchedule(f"trials at {len(trials)} speeds, at least {FEWEST} are needed")
    most = np.unique(np.round(speeds, 1)).size - 1
    degrees = tuple(min(degree, most) for degree in degrees)
    lines = [independent_lines(trial.response) for trial in trials]
    for trial, found in zip(trials, lines, strict=True):
        if isinstance(found, NoRational):
            return NoSchedule(f"at {trial.speed:.1f} m/s: {found.reason}")
    problem = _Problem.of(trials, degrees)
    best = problem.search()
    freedom = best.fun.size - best.x.size
    ratio = 2 * float(best.cost) / freedom
    covariance = np.linalg.pinv(best.jac.T @ best.jac) * max(1.0, ratio)
    return ScheduledFit(
        best.x,
        covariance,
        degrees,
        problem.centre,
        float(speeds.min()),
        float(speeds.max()),
        float(stats.t.ppf(0.975, freedom)),
        ratio,
    )


def leave_one_out(trials: Sequence[Trial]) -> tuple[LeftOutSpeed, ...] | NoSchedule:
    """Predict each speed but the outermost from the others, so that nothing is extrapolated."""
    if len(trials) <= FEWEST:
        return NoSchedule(f"trials at {len(trials)} speeds, at least {FEWEST + 1} are needed")
    inner = sorted(trials, key=lambda trial: trial.speed)[1:-1]
    rows = []
    for trial in inner:
        rest = [other for other in trials if other is not trial]
        own, same = fit_scheduled(rest), fit_scheduled(rest, (0,) * len(NAMES))
        if isinstance(own, NoSchedule) or isinstance(same, NoSchedule):
            return own if isinstance(own, NoSchedule) else NoSchedule("no constant model")
        rows.append(LeftOutSpeed(trial.speed, *(_error(fit, trial) for fit in (own, same))))
    return tuple(rows)


def _error(fit: ScheduledFit, trial: Trial) -> float:
    lines = trial.response.reliable
    value = trial.response.value[lines]
    modelled = fit.at(trial.speed).response(trial.response.frequency[lines])
    return float(np.sqrt(np.sum(np.abs(modelled - value) ** 2) / np.sum(np.abs(value) ** 2)))


@dataclass(frozen=True)
class _Problem:
    """Weighted residuals of all trials: one row a line. x: ln(v / centre) of each line."""

    frequency: FloatArray
    value: ComplexArray
    weight: FloatArray
    where: tuple[tuple[float, slice], ...]
    centre: float
    degrees: tuple[int, ...]

    @staticmethod
    def of(trials: Sequence[Trial], degrees: tuple[int, ...]) -> "_Problem":
        centre = float(np.exp(np.mean(np.log([trial.speed for trial in trials]))))
        frequency, value, weight, where, n = [], [], [], [], 0
        for trial in trials:
            lines = independent_lines(trial.response)
            assert not isinstance(lines, NoRational)
            frequency.append(lines.frequency)
            value.append(lines.value)
            weight.append(np.sqrt(2) / np.hypot(lines.deviation, ACCURACY * np.abs(lines.value)))
            where.append((float(np.log(trial.speed / centre)), slice(n, n + lines.value.size)))
            n += lines.value.size
        return _Problem(
            np.concatenate(frequency),
            np.concatenate(value),
            np.concatenate(weight),
            tuple(where),
            centre,
            degrees,
        )

    def residual(self, c: FloatArray) -> FloatArray:
        error = np.empty(self.frequency.size, dtype=np.complex128)
        for x, part in self.where:
            p = np.clip(_raw(c, self.degrees, x), LOW, HIGH)
            error[part] = _model(p).response(self.frequency[part]) - self.value[part]
        error = error * self.weight
        return np.concatenate((error.real, error.imag))

    def solve(self, start: FloatArray, most: int) -> OptimizeResult:
        found: OptimizeResult = least_squares(
            self.residual, start, x_scale="jac", method="trf", max_nfev=most
        )
        return found

    def search(self) -> OptimizeResult:
        """A few steps from several starts, the best to the end."""
        low = np.abs(self.value[np.argsort(self.frequency)[:5]])
        level = float(np.log(np.median(low)))
        found = []
        for pole, delay, band in product((4e-3, 15e-3), (4e-3, 12e-3), (6.0, 9.0)):
            p = [level, np.log(pole), 0.0, np.log(2 * np.pi * band), np.log(0.3)]
            p += [np.log(2 * np.pi * 13), np.log(0.4), delay]
            start = np.concatenate([[v, *[0.0] * d] for v, d in zip(p, self.degrees, strict=True)])
            found.append(self.solve(start, 10))
        return self.solve(min(found, key=lambda one: float(one.cost)).x, 100)


def _own(degrees: tuple[int, ...], i: int) -> slice:
    start = sum(degrees[:i]) + i
    return slice(start, start + degrees[i] + 1)


def _raw(c: FloatArray, degrees: tuple[int, ...], x: float) -> FloatArray:
    """Parameters at one x, still logarithms."""
    rows = (c[_own(degrees, i)] for i in range(len(degrees)))
    return np.array([row @ x ** np.arange(row.size) for row in rows])


def _model(p: FloatArray) -> SwitchedModel:
    k, pole, zero, w1, z1, w2, z2, delay = map(float, np.where(LOGARITHMIC, np.exp(p), p))
    side = Direction(k, pole, zero)
    return SwitchedModel(side, side, ((w1, z1), (w2, z2)), delay)

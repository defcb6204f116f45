"""A switched model is fitted on steps: each averaged step lasts in one direction from end to end.

Least squares on the mean opening and the mean closing step. Gain, real pole and zero are free in
each direction, or the same in both (the linear model); resonances and delay are shared. A constant
and a slow slope of each direction (speed that still drifts) are projected out. The covariance comes
from the scatter between steps, not from the samples, whose errors are not independent.

    fit = fit_steps(steps)                               # SwitchedFit
    fit.model.opening.pole, fit.half_width("opening.pole")
    linear = fit_steps(steps, split=False)
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy import stats
from scipy.optimize import OptimizeResult, least_squares

from slipbench.identification.models.steps import Bundle, Steps
from slipbench.identification.models.switched import Direction, IntArray, SwitchedModel, simulate
from slipbench.protocol.recording.channel import FloatArray

SPACING = 4  # samples between those that are compared; the wheel's speed was low-passed before
POLES, DELAYS = (3e-3, 20e-3), (5e-3, 15e-3)  # s, starts
BANDS = (5.0, 8.0, 13.0)  # Hz, starts of the resonance
TOGETHER = (13.0, 0.4)  # Hz and damping at which a second pair starts: a servo's
LEAST_GAIN = 1e-12


@dataclass(frozen=True)
class SwitchedFit:
    """A model with the uncertainty of its parameters.

    names       of the parameters: "opening.gain", "closing.pole", "frequency 1", "delay" ...
    value       (p,) SI: output per input, s, rad/s, 1; covariance: (p, p) of them
    quantile    two-sided 95 % quantile that belongs to it
    error       root mean square of the residual of the mean steps, over that of the steps
    criterion   BIC with the scatter's own variance, to compare numbers of resonances
    """

    model: SwitchedModel
    names: tuple[str, ...]
    value: FloatArray
    covariance: FloatArray
    quantile: float
    error: float
    criterion: float

    def half_width(self, name: str) -> float:
        """Half width of a parameter's 95 % interval."""
        i = self.names.index(name)
        return self.quantile * float(np.sqrt(self.covariance[i, i]))

    def difference(self, name: str) -> tuple[float, float]:
        """Closing minus opening, and the half width of its interval.

        name: "gain", "pole", "zero", or "lag": pole less zero, by how much a response is later.
        """
        parts = {"pole": 1.0, "zero": -1.0} if name == "lag" else {name: 1.0}
        weight = np.zeros(len(self.names))
        for part, share in parts.items():
            weight[self.names.index(f"closing.{part}")] = share
            weight[self.names.index(f"opening.{part}")] = -share
        deviation = float(np.sqrt(weight @ self.covariance @ weight))
        return float(weight @ self.value), self.quantile * deviation


def fit_steps(steps: Steps, pairs: int | None = None, split: bool = True) -> SwitchedFit:
    """Fit a switched model, or with split=False a linear one.

    pairs: resonances that are shared; None takes one or two, by BIC of the switched model.
    """
    if pairs is None:
        return min((fit_steps(steps, n, split) for n in (1, 2)), key=lambda fit: fit.criterion)
    problem = _Problem(steps)
    best = _search(problem, pairs)
    if split:
        best = problem.solve(np.concatenate((best.x[:3], best.x)), pairs)
    return _judged(problem, best, _names(pairs, split), pairs)


def fit_by(steps: Steps, start: SwitchedFit, modes: IntArray, lag: float) -> SwitchedFit:
    """Fit a switched model whose mode is another signal's sign, from the fit of a first one.

    modes: (2, n), mode during the opening and during the closing step; lag: s, how late it acts.
    """
    pairs = len(start.model.resonances)
    problem = _Problem(steps, modes, lag)
    positive = _is_log(start.value.size, pairs)
    x = np.where(positive, np.log(np.where(positive, start.value, 1.0)), start.value)
    return _judged(problem, problem.solve(x, pairs), start.names, pairs)


@dataclass(frozen=True)
class _Problem:
    """Residuals of the mean steps. Parameters are logarithms but for the zeros and the delay."""

    steps: Steps
    modes: IntArray | None = None
    lag: float | None = None

    def residual(self, p: FloatArray, pairs: int) -> FloatArray:
        model = _model(p, pairs)
        residuals = [
            side.mean - self._response(model, k, side) for k, side in enumerate(self.sides)
        ]
        return np.asarray(self.cut(np.stack(residuals)[None])[0] / self.scale)

    def _response(self, model: SwitchedModel, mode: int, side: Bundle) -> FloatArray:
        u = side.input.mean(axis=0)
        modes = np.full(u.size, mode) if self.modes is None else self.modes[mode]
        return simulate(model, u, modes, self.steps.rate, self.lag)

    @cached_property
    def slow(self) -> FloatArray:
        """Constants of both directions, a slope that turns at the step; orthonormal, (3, 2 n)."""
        time = self.steps.time
        one, none, slope = np.ones_like(time), np.zeros_like(time), np.maximum(time, 0.0)
        rows = [[one, none], [none, one], [slope, -slope]]
        q, _ = np.linalg.qr(np.array(rows).reshape(3, -1).T)
        return np.ascontiguousarray(q.T)

    def cut(self, y: FloatArray) -> FloatArray:
        """Take the slow part off; keep every few samples. y: (k, 2, n), opening and closing."""
        flat = y.reshape(len(y), -1)
        residual = flat - flat @ self.slow.T @ self.slow
        return np.asarray(residual.reshape(y.shape)[..., ::SPACING].reshape(len(y), -1))

    @property
    def sides(self) -> tuple[Bundle, Bundle]:
        return self.steps.opening, self.steps.closing

    @property
    def scale(self) -> float:
        return float(np.ptp(self.steps.opening.mean))

    def solve(self, start: FloatArray, pairs: int, most: int = 60) -> OptimizeResult:
        low, high = _bounds(pairs, start.size > 4 + 2 * pairs)
        start = np.clip(start, low + 1e-6, high - 1e-6)
        found: OptimizeResult = least_squares(
            self.residual, start, args=(pairs,), bounds=(low, high), x_scale="jac", max_nfev=most
        )
        return found


def _search(problem: _Problem, pairs: int) -> OptimizeResult:
    """Fit a linear model from several starts: a few steps from each, the best to the end."""
    first = [problem.solve(start, pairs, most=8) for start in _starts(problem.steps, pairs)]
    return problem.solve(min(first, key=lambda found: float(found.cost)).x, pairs)


def _starts(steps: Steps, pairs: int) -> Iterator[FloatArray]:
    end = slice(-steps.time.size // 4, None)
    gain = max(abs(np.median(steps.opening.mean[end]) / steps.opening.size), LEAST_GAIN)
    second = [np.log(2 * np.pi * TOGETHER[0]), np.log(TOGETHER[1])] * (pairs - 1)
    for pole, delay, band in product(POLES, DELAYS, BANDS):
        pair = [np.log(2 * np.pi * band), np.log(0.3), *second]
        yield np.array([np.log(gain), np.log(pole), 0.0, *pair, delay])


def _bounds(pairs: int, split: bool) -> tuple[FloatArray, FloatArray]:
    side = [(-np.inf, np.inf), (np.log(2e-4), np.log(1.0)), (-0.3, 0.3)] * (2 if split else 1)
    pair = [(np.log(2 * np.pi), np.log(2 * np.pi * 40)), (np.log(0.02), np.log(1.5))] * pairs
    low, high = np.array([*side, *pair, (0.0, 0.06)]).T
    return low, high


def _natural(p: FloatArray, pairs: int) -> FloatArray:
    """Parameters in their own units, those of the directions first."""
    return np.where(_is_log(p.size, pairs), np.exp(p), p)


def _is_log(size: int, pairs: int) -> FloatArray:
    sides = (size - 1 - 2 * pairs) // 3
    return np.array([True, True, False] * sides + [True, True] * pairs + [False])


def _model(p: FloatArray, pairs: int) -> SwitchedModel:
    x = _natural(p, pairs)
    sides = x[: x.size - 1 - 2 * pairs].reshape(-1, 3)
    shared = x[x.size - 1 - 2 * pairs : -1].reshape(-1, 2)
    first, last = (Direction(*map(float, side)) for side in (sides[0], sides[-1]))
    return SwitchedModel(first, last, tuple((float(w), float(z)) for w, z in shared), float(x[-1]))


def _names(pairs: int, split: bool) -> tuple[str, ...]:
    sides = ("opening.", "closing.") if split else ("",)
    own = [f"{side}{name}" for side in sides for name in ("gain", "pole", "zero")]
    shared = [f"{name} {i + 1}" for i in range(pairs) for name in ("frequency", "damping")]
    return (*own, *shared, "delay")


def _judged(
    problem: _Problem, best: OptimizeResult, names: tuple[str, ...], pairs: int
) -> SwitchedFit:
    """Covariance (J'J)^-1 J' S J (J'J)^-1, S from the scatter between steps, and the criterion."""
    J, count = np.asarray(best.jac), best.fun.size
    middle = sum(_scatter(problem, k, J) for k in (0, 1))
    bread = np.linalg.pinv(J.T @ J)
    slope = np.where(_is_log(best.x.size, pairs), np.exp(best.x), 1.0)
    covariance = bread @ middle @ bread * slope[:, None] * slope
    fewest = min(len(side.output) for side in problem.sides)
    power = float(np.mean(best.fun**2))
    steps = problem.cut(np.stack([side.mean for side in problem.sides])[None]) / problem.scale
    return SwitchedFit(
        _model(best.x, pairs),
        names,
        _natural(best.x, pairs),
        covariance,
        float(stats.t.ppf(0.975, fewest - 1)),
        float(np.sqrt(power / np.mean(steps**2))),
        count * float(np.log(power)) + best.x.size * float(np.log(count)),
    )


def _scatter(problem: _Problem, mode: int, J: FloatArray) -> FloatArray:
    """Covariance of J' times the error of one direction's mean step."""
    side = problem.sides[mode]
    both = np.zeros((len(side.output), 2, side.output.shape[1]))
    both[:, mode] = side.output - side.mean
    scores = problem.cut(both) / problem.scale @ J
    return np.asarray(scores.T @ scores / (len(scores) - 1) / len(scores))

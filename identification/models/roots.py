"""Poles and zeros of a fitted model with their 95 % regions.

    poles, zeros = roots_with_intervals(fit)
    poles[0].value, poles[0].half_widths, poles[0].contains(-8 + 40j)

The covariance of the parameters is propagated to the real and the imaginary part of each root by the
derivative of the root. Where other orders are plausible, their nearest root of the same kind widens the
covariance, as it widens the natural frequencies (Burnham and Anderson, Model Selection and Multimodel
Inference, 2nd ed., section 4.3.2).
"""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from slipbench.identification.models.rational_ml import Mode, RationalFit
from slipbench.identification.models.stable_rational import model
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

STEP = 1e-5  # of a parameter, finite-difference step


@dataclass(frozen=True)
class Root:
    """A pole or zero. value: rad/s; covariance: of real and imaginary part, (2, 2), (rad/s)^2."""

    value: complex
    covariance: FloatArray

    @property
    def real(self) -> bool:
        """Whether the root lies on the real axis."""
        return self.value.imag == 0

    @property
    def half_widths(self) -> tuple[float, float]:
        """Half widths of the 95 % intervals of real and imaginary part, each by itself, rad/s."""
        across = float(stats.norm.ppf(0.975))
        width = across * np.sqrt(np.diag(self.covariance))
        return float(width[0]), float(width[1])

    def contains(self, value: complex) -> bool:
        """Whether a value, rad/s, is in the 95 % region: an interval for a real root, else an ellipse."""
        away = np.array([value.real - self.value.real, value.imag - self.value.imag])
        if self.real:
            return bool(value.imag == 0 and abs(away[0]) <= self.half_widths[0])
        distance = away @ np.linalg.pinv(self.covariance, hermitian=True) @ away
        return bool(distance <= stats.chi2.ppf(0.95, 2))

    def outline(self, points: int = 49) -> ComplexArray:
        """Outline of the 95 % region, rad/s, shape (points,); for a real root its interval, (2,)."""
        if self.real:
            return np.asarray(self.value + np.array([-1, 1]) * self.half_widths[0], dtype=complex)
        size, axes = np.linalg.eigh(self.covariance)
        angle = np.linspace(0, 2 * np.pi, points)
        radius = np.sqrt(np.maximum(size, 0.0) * stats.chi2.ppf(0.95, 2))
        x, y = axes @ (radius[:, None] * np.stack((np.cos(angle), np.sin(angle))))
        return np.asarray(self.value + x + 1j * y)


def roots_with_intervals(fit: RationalFit) -> tuple[tuple[Root, ...], tuple[Root, ...]]:
    """Poles and zeros with positive or no imaginary part; the conjugates mirror them."""
    return _with_order_uncertainty(fit, "poles"), _with_order_uncertainty(fit, "zeros")


def real_poles(fit: RationalFit) -> list[tuple[float, float]]:
    """Frequencies of the real poles and half widths of their 95 % intervals, Hz; the slowest first."""
    poles, _ = roots_with_intervals(fit)
    return sorted(
        (abs(one.value) / (2 * np.pi), one.half_widths[0] / (2 * np.pi))
        for one in poles
        if one.real
    )


def oscillating(fit: RationalFit) -> list[Mode]:
    """Pairs of complex poles; a pair whose damping ratio is 1 or more is two real poles."""
    return [mode for mode in fit.modes if not mode.single and mode.damping < 1.0]


def _with_order_uncertainty(fit: RationalFit, kind: str) -> tuple[Root, ...]:
    others = [(weight, _of_order(rival, kind)) for weight, rival in fit.rivals]
    return tuple(_widened(root, others) for root in _of_order(fit, kind))


def _of_order(fit: RationalFit, kind: str) -> tuple[Root, ...]:
    values = _upper(fit, fit.x, kind)
    slopes = np.empty((fit.x.size - 1, values.size), dtype=complex)
    for k in range(fit.x.size - 1):
        step = STEP * max(1.0, abs(fit.x[k]))
        ahead, back = (
            _nearest(_all(fit, fit.x + sign * step * np.eye(fit.x.size)[k], kind), values)
            for sign in (1, -1)
        )
        slopes[k] = (ahead - back) / (2 * step)
    C = fit.covariance[:-1, :-1]
    made = []
    for value, slope in zip(values, slopes.T, strict=True):
        J = np.stack((slope.real, np.zeros_like(slope.real) if value.imag == 0 else slope.imag))
        made.append(Root(complex(value), J @ C @ J.T))
    return tuple(made)


def _widened(root: Root, others: list[tuple[float, tuple[Root, ...]]]) -> Root:
    """Root with the variance of a mixture over the orders that have such a root."""
    same = []
    for weight, roots in others:
        same_kind = [one for one in roots if one.real == root.real]
        if same_kind:
            same.append((weight, min(same_kind, key=lambda one: abs(one.value - root.value))))
    covariance = (1 - sum(weight for weight, _ in same)) * root.covariance
    for weight, one in same:
        apart = np.array([one.value.real - root.value.real, one.value.imag - root.value.imag])
        covariance = covariance + weight * (one.covariance + np.outer(apart, apart))
    return Root(root.value, covariance)


def _all(fit: RationalFit, x: FloatArray, kind: str) -> ComplexArray:
    at = model(x[:-1], fit.order, fit.pace, (fit.lines.input, fit.lines.output))
    return np.asarray(getattr(at, kind), dtype=complex)


def _upper(fit: RationalFit, x: FloatArray, kind: str) -> ComplexArray:
    values = _all(fit, x, kind)
    return np.asarray(values[values.imag >= 0])


def _nearest(candidates: ComplexArray, to: ComplexArray) -> ComplexArray:
    if not to.size:
        return to
    return np.asarray(candidates[np.argmin(np.abs(candidates[None, :] - to[:, None]), axis=1)])

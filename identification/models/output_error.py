"""A rational function with delay fitted in time: for runs too short for their resonances.

A run of a few seconds has few lines, and a response that rings for as long has no smooth spectrum:
local polynomials then bias it. Simulated from rest, a model has no window and no leakage. Output
error (Ljung, System Identification, 2nd ed., section 4.2): the least sum of squares of the
measured less the simulated output, from several starts. The residual is mostly not noise but
what no linear function describes, so orders are compared over the independent samples that the
excited band holds, 2 B T of each different run, and not over all that were stored.

A band that does not reach to zero does not determine where an output comes to rest: an acceleration
that follows no steady input would be given a steady gain. So the best orders are also fitted with a
zero at s = 0, and this form is selected where its description length is as short.

    found = output_error(u, y, rate, band, names)       # OutputError; found.model
"""

from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from scipy import optimize, signal

from slipbench.identification.models.model_order import (
    Criteria,
    OrderChoice,
    Row,
    of_residuals,
    ranked,
)
from slipbench.identification.models.model_order import orders as usual_orders
from slipbench.identification.models.rational_model import RationalModel
from slipbench.identification.models.sanathanan_koerner import first_guess
from slipbench.identification.models.stable_rational import GREATEST, LEAST, Order, model
from slipbench.identification.response.response import ComplexArray
from slipbench.identification.signals.samples import BoolArray
from slipbench.protocol.recording.channel import FloatArray

MOST_POLES, MOST_ZEROS = 6, 5
LONGEST = 0.03  # share of a run that a delay may last
STARTS = (0.0, 0.3)  # of the longest delay
EVALUATIONS = 60


@dataclass(frozen=True)
class TimeFit:
    """One order. x: of `stable_rational`, (p,); covariance (p, p); pace: rad/s; error: rms."""

    order: Order
    model: RationalModel
    x: FloatArray
    covariance: FloatArray
    pace: float
    error: float


@dataclass(frozen=True)
class OutputError:
    """All candidate orders, and the one of least description length."""

    choice: OrderChoice[TimeFit]
    independent: int  # samples

    @property
    def fit(self) -> TimeFit:
        """The order of least description length."""
        return self.choice.best_by_mdl.fit

    @property
    def model(self) -> RationalModel:
        """Its rational function."""
        return self.fit.model


def output_error(
    u: FloatArray,
    y: FloatArray,
    rate: float,
    band: tuple[float, float],
    names: tuple[str, str],
    tried: tuple[Order, ...] | None = None,
) -> OutputError:
    """Fit runs that begin at rest. u, y: (runs, n); rate: Hz; band: Hz that u excites."""
    u, y = u - u[:, :1], y - y[:, :1]
    different, which = np.unique(u, axis=0, return_inverse=True)
    target = np.stack([y[which == k].mean(axis=0) for k in range(len(different))])
    independent = max(round(2 * (band[1] - band[0]) * u.shape[1] / rate * len(different)), 16)
    pace = 2 * np.pi * band[1] / 1.5
    rows: list[Row[TimeFit]] = []
    for poles, group in groupby(tried or usual_orders(MOST_POLES, MOST_ZEROS), lambda o: o.poles):
        before = min((row.criteria.mdl for row in rows), default=np.inf)
        for order in group:
            fit = _best(different, target, rate, order, pace, band, names, independent)
            rows.append(Row(order, fit, _criteria(fit, independent)))
        if min(row.criteria.mdl for row in rows if row.order.poles == poles) > before:
            break  # one more pole does not reduce the description length
    for row in ranked(rows).within() if rows else ():
        if row.order.zeros:
            fit = _at_rest(row.fit, different, target, rate, names, independent)
            rows.append(Row(fit.order, fit, _criteria(fit, independent)))
    return OutputError(ranked(rows), independent)


def _at_rest(
    of: TimeFit,
    u: FloatArray,
    target: FloatArray,
    rate: float,
    names: tuple[str, str],
    independent: int,
) -> TimeFit:
    """Fit the same order with a zero at s = 0, from where `of` ended."""
    held = replace(of.order, at_rest=1)
    free = np.ones(of.x.size, dtype=bool)
    free[1 + of.order.poles] = False
    low, high = _bounds(of.order, LONGEST * u.shape[1] / rate * of.pace)
    problem = _Problem(of.order, u, target, rate / of.pace)

    def residuals(z: FloatArray) -> FloatArray:
        return problem.residuals(_filled(free, z))

    found = optimize.least_squares(
        residuals,
        np.clip(of.x[free], low[free] + 1e-9, high[free] - 1e-9),
        bounds=(low[free], high[free]),
        x_scale="jac",
        max_nfev=EVALUATIONS,
    )
    covariance = np.zeros((free.size, free.size))
    error, covariance[np.ix_(free, free)] = _sure(found, target.size, independent)
    x = _filled(free, found.x)
    of_x = model(x, of.order, of.pace, names)
    return TimeFit(held, of_x, x, covariance, of.pace, error)


def _filled(free: BoolArray, z: FloatArray) -> FloatArray:
    x = np.zeros(free.size)
    x[free] = z
    return x


def _criteria(fit: TimeFit, independent: int) -> Criteria:
    return of_residuals(fit.error**2 * independent, fit.order.size, independent)


def _best(
    u: FloatArray,
    target: FloatArray,
    rate: float,
    order: Order,
    pace: float,
    band: tuple[float, float],
    names: tuple[str, str],
    independent: int,
) -> TimeFit:
    longest = LONGEST * u.shape[1] / rate * pace
    low, high = _bounds(order, longest)
    residuals = _Problem(order, u, target, rate / pace).residuals
    fits = []
    for share in STARTS:
        start = np.clip(_start(u, target, rate, order, pace, band, share * longest), low, high)
        inner = np.clip(start, low + 1e-9, high - 1e-9)
        fits.append(
            optimize.least_squares(
                residuals, inner, bounds=(low, high), x_scale="jac", max_nfev=EVALUATIONS
            )
        )
    found = min(fits, key=lambda f: float(f.cost))
    error, covariance = _sure(found, target.size, independent)
    return TimeFit(order, model(found.x, order, pace, names), found.x, covariance, pace, error)


@dataclass(frozen=True)
class _Problem:
    """Input and output that are fitted, at `rate` samples a unit of time."""

    order: Order
    u: FloatArray
    target: FloatArray
    rate: float

    def residuals(self, x: FloatArray) -> FloatArray:
        """Residuals of the model, (runs * n,)."""
        with np.errstate(all="ignore"):
            error = response_of(x, self.order, self.u, self.rate) - self.target
        return np.asarray(np.nan_to_num(error, nan=1e6, posinf=1e6, neginf=-1e6).ravel())


def _bounds(order: Order, longest: float) -> tuple[FloatArray, FloatArray]:
    low = np.concatenate(([0.0], np.full(order.poles, LEAST), np.full(order.zeros + 1, -np.inf)))
    high = np.concatenate(
        ([longest], np.full(order.poles, GREATEST), np.full(order.zeros + 1, np.inf))
    )
    return low, high


def _sure(
    found: optimize.OptimizeResult, samples: int, independent: int
) -> tuple[float, FloatArray]:
    """Root mean square of the residual, and the covariance that follows from it."""
    error = float(np.sqrt(2 * found.cost / samples))
    J = np.asarray(found.jac)
    scale = np.sqrt(np.sum(J**2, axis=0)) + 1e-300
    inverse = np.linalg.pinv((J / scale).T @ (J / scale), rcond=1e-10) / np.outer(scale, scale)
    return error, np.asarray(inverse * error**2 * samples / independent)


def _start(
    u: FloatArray,
    target: FloatArray,
    rate: float,
    order: Order,
    pace: float,
    band: tuple[float, float],
    delay: float,
) -> FloatArray:
    """First guess from the quotient of the spectra, padded so that what rings on has room."""
    n = 2 * u.shape[1]
    f = np.fft.rfftfreq(n, 1 / rate)
    inside = (f >= band[0]) & (f <= band[1])
    U, Y = (np.fft.rfft(x, n, axis=1)[:, inside] for x in (u, target))
    power = np.sum(np.abs(U) ** 2, axis=0)
    value: ComplexArray = np.asarray(np.sum(Y * U.conj(), axis=0) / power)
    s: ComplexArray = np.asarray(2j * np.pi * f[inside] / pace)
    return first_guess(s, value, np.sqrt(power / power.max()), order, delay)


def response_of(x: FloatArray, order: Order, u: FloatArray, rate: float) -> FloatArray:
    """Simulate from rest. u: (runs, n), held between samples at `rate` samples a unit of time."""
    n = order.poles
    a, b = np.exp(x[1 : 1 + n]), x[1 + n :]
    below = np.ones(1)
    for i in range(0, n - 1, 2):
        below = np.convolve(below, [a[i + 1], a[i], 1.0])
    if n % 2:
        below = np.convolve(below, [a[-1], 1.0])
    B, A, _ = signal.cont2discrete((b[::-1], below), 1 / rate, "zoh")
    y = signal.lfilter(np.atleast_1d(np.squeeze(B)), A, u, axis=1)
    late = x[0] * rate
    whole = int(late)
    part = late - whole
    one, two = (np.pad(y, ((0, 0), (k, 0)))[:, : u.shape[1]] for k in (whole, whole + 1))
    return np.asarray((1 - part) * one + part * two)

"""Rational functions as the paper fits them: equation 4, a known delay, the order by FPE.

    minimise  sum_i w_i |G(j w_i) e^(j w_i d) - N(j w_i) / D(j w_i)|^2

by damped Gauss-Newton over the polynomials' coefficients from several starts (Corno and Savaresi,
SYSID 2009, equation 4). The delay d is given, a grid of them at a time; poles are not constrained,
but only stable results count, where there are any.

    table = choose_paper_order(lines, delay=0.010)
    table.best_by_fpe.fit.model
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.models.gauss_newton import Minimum, minimise
from slipbench.identification.models.model_order import (
    OrderChoice,
    Row,
    of_residuals,
    orders,
    ranked,
    resolved,
)
from slipbench.identification.models.rational_ml import pace_of
from slipbench.identification.models.rational_model import RationalModel
from slipbench.identification.models.sanathanan_koerner import first_guess
from slipbench.identification.models.stable_rational import Order
from slipbench.identification.response.independent_lines import Lines
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

STARTS = 5
SCATTER = 0.3  # of the coefficients, from start to start


@dataclass(frozen=True)
class PaperFit:
    """model: with the delay that was given. cost: equation 4 at its least."""

    order: Order
    model: RationalModel
    cost: float


def choose_paper_order(
    lines: Lines,
    delay: float,
    weight: FloatArray | None = None,
    tried: tuple[Order, ...] | None = None,
    seed: int = 1,
) -> OrderChoice[PaperFit]:
    """Fit every order with a given delay (s) and score it; criteria count residuals alone.

    weight: (n,), of each squared error; 1 / deviation^2 where none is given.
    """
    samples = 2 * lines.frequency.size
    fits = [
        paper_fit(lines, order, delay, weight, seed)
        for order in tried or orders()
        if 2 * order.size <= samples
    ]
    kept = [fit for fit in fits if fit.model.stable and resolved(fit.model, lines)] or fits
    return ranked(
        [Row(fit.order, fit, of_residuals(fit.cost, fit.order.size - 1, samples)) for fit in kept]
    )


def paper_fit(
    lines: Lines, order: Order, delay: float, weight: FloatArray | None = None, seed: int = 1
) -> PaperFit:
    """Minimise equation 4 for one order and one delay (s), from several starts."""
    pace = pace_of(lines)
    s = np.asarray(2j * np.pi * lines.frequency / pace)
    w = np.sqrt(1 / lines.deviation**2 if weight is None else weight)
    value = np.asarray(lines.value * np.exp(s * delay * pace))
    names = (lines.input, lines.output)
    found = [
        PaperFit(order, _model(m.x, order, pace, delay, names), m.cost)
        for m in (_search(s, value, w, order, x) for x in _starts(s, value, w, order, seed))
    ]
    stable = [fit for fit in found if fit.model.stable]
    sound = [fit for fit in stable if resolved(fit.model, lines)]
    return min(sound or stable or found, key=lambda fit: fit.cost)


def equation_error(
    x: FloatArray, s: ComplexArray, order: Order
) -> tuple[ComplexArray, ComplexArray]:
    """N / D (n,) and its derivatives (n, p). x: a_1 .. a_n of D = 1 + ..., then b_0 .. b_m."""
    n = order.poles
    powers = s[:, None] ** np.arange(max(n, order.zeros) + 1)
    above, below = powers[:, : order.zeros + 1], powers[:, 1 : n + 1]
    D = 1 + below @ x[:n]
    G = (above @ x[n:]) / D
    return G, np.hstack((-G[:, None] * below, above)) / D[:, None]


def _search(
    s: ComplexArray, value: ComplexArray, w: FloatArray, order: Order, start: FloatArray
) -> Minimum:
    def residuals(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        G, slopes = equation_error(x, s, order)
        error, slope = (G - value) * w, slopes * w[:, None]
        return np.concatenate((error.real, error.imag)), np.vstack((slope.real, slope.imag))

    far = np.full(start.size, np.inf)
    return minimise(residuals, start, -far, far)


def _starts(
    s: ComplexArray, value: ComplexArray, w: FloatArray, order: Order, seed: int
) -> list[FloatArray]:
    """The linear guess, and others scattered about it."""
    guess = first_guess(s, value, w, order, 0.0)
    first = np.concatenate((_denominator(guess, order)[1:], guess[1 + order.poles :]))
    scatter = np.random.default_rng(seed).normal(1.0, SCATTER, (STARTS - 1, first.size))
    return [first, *(first * scatter)]


def _denominator(x: FloatArray, order: Order) -> FloatArray:
    """Turn the factors of `stable_rational` into a polynomial, lowest power first."""
    a = np.exp(x[1 : 1 + order.poles])
    D = np.ones(1)
    for i in range(0, order.poles - 1, 2):
        D = np.convolve(D, [1.0, a[i], a[i + 1]])
    return np.convolve(D, [1.0, a[-1]]) if order.poles % 2 else D


def _model(
    x: FloatArray, order: Order, pace: float, delay: float, names: tuple[str, str]
) -> RationalModel:
    n = order.poles
    poles = np.roots(np.concatenate((x[:n][::-1], [1.0]))).astype(np.complex128) * pace
    zeros = np.roots(x[n:][::-1]).astype(np.complex128) * pace
    gain = x[n + zeros.size] / x[poles.size - 1] * pace ** (poles.size - zeros.size)
    return RationalModel(*names, zeros, poles, float(gain), delay)

"""First guesses of a rational function, each by a few linear least-squares problems.

The equation error N - G D is linear in the coefficients; divided by the denominator of the round
before it becomes the error of the response itself (Sanathanan and Koerner, IEEE Transactions on
Automatic Control 8, 1963).
"""

import numpy as np

from slipbench.identification.models.stable_rational import Order, evaluate, parameters
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

ROUNDS = 6


def first_guess(
    s: ComplexArray, value: ComplexArray, weight: FloatArray, order: Order, delay: float
) -> FloatArray:
    """The parameters of `stable_rational` for a delay that is taken as known.

    s: (n,) in the normalised unit; value: (n,); weight: (n,) of the error, 1 / deviation.
    """
    G = value * np.exp(s * delay)
    powers = s[:, None] ** np.arange(max(order.poles, order.zeros) + 1)
    above, below = powers[:, : order.zeros + 1], powers[:, 1 : order.poles + 1]
    size: FloatArray = np.ones(s.size)
    c = np.zeros(order.poles + order.zeros + 1)
    for _ in range(ROUNDS):
        scale = (weight / size)[:, None]
        system = np.hstack((above, -G[:, None] * below)) * scale
        c = _real_solution(system, G * scale[:, 0])
        size = np.abs(1 + below @ c[order.zeros + 1 :]) + 1e-9
    denominator = np.concatenate(([1.0], c[order.zeros + 1 :]))
    x = parameters(delay, denominator, c[: order.zeros + 1], order)
    return _with_best_numerator(x, s, value, weight, order)


def _with_best_numerator(
    x: FloatArray, s: ComplexArray, value: ComplexArray, weight: FloatArray, order: Order
) -> FloatArray:
    """The poles may have been moved into the left half plane: fit the numerator anew."""
    basis = evaluate(x, s, order)[1][:, 1 + order.poles :] * weight[:, None]
    x[1 + order.poles :] = _real_solution(basis, value * weight)
    return x


def _real_solution(system: ComplexArray, right: ComplexArray) -> FloatArray:
    A = np.vstack((system.real, system.imag))
    size = np.sqrt(np.sum(A**2, axis=0)) + 1e-300
    y = np.concatenate((right.real, right.imag))
    return np.asarray(np.linalg.lstsq(A / size, y, rcond=None)[0] / size)

"""Damped Gauss-Newton for small least-squares problems whose Jacobian is known.

The damping is Marquardt's: a share of the diagonal, less after a step that helped, more after one
that did not (Marquardt, SIAM J. Appl. Math. 11, 1963). Parameters stay inside their bounds; one
that is pushed against a bound rests there.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slipbench.protocol.recording.channel import FloatArray

Residuals = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
MOST_STEPS = 80
ENOUGH = 1e-9  # relative fall of the cost below which nothing more is to be had
GREATEST_DAMPING = 1e9


@dataclass(frozen=True)
class Minimum:
    """x: (p,). cost: sum of squared residuals. jacobian: (n, p) of the residuals at x."""

    x: FloatArray
    cost: float
    jacobian: FloatArray


def minimise(
    of: Residuals, start: FloatArray, low: FloatArray, high: FloatArray, most: int = MOST_STEPS
) -> Minimum:
    """Find the x between low and high, all (p,), with the least sum of squared residuals.

    of: x -> residuals (n,) and their Jacobian (n, p). low == high holds a parameter.
    most: steps after which the search ends.
    """
    x = np.clip(start, low, high)
    residual, jacobian = of(x)
    cost, damping = float(residual @ residual), 1e-3
    for _ in range(most):
        trial = np.clip(x + _step(residual, jacobian, x, low, high, damping), low, high)
        if _promised(trial - x, residual, jacobian) <= ENOUGH * cost:
            break
        new_residual, new_jacobian = of(trial)
        new = float(new_residual @ new_residual)
        if not new < cost:  # NaN does not help either
            damping *= 4
            if damping > GREATEST_DAMPING:
                break
            continue
        done = cost - new <= ENOUGH * cost
        x, residual, jacobian, cost = trial, new_residual, new_jacobian, new
        damping = max(damping / 5, 1e-12)
        if done:
            break
    return Minimum(x, cost, jacobian)


def _promised(step: FloatArray, residual: FloatArray, jacobian: FloatArray) -> float:
    """The fall of the cost that a step has if the residuals are straight along it."""
    along = jacobian @ step
    return -float(along @ (2 * residual + along))


def free(
    gradient: FloatArray, x: FloatArray, low: FloatArray, high: FloatArray
) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
    """Mask of the parameters that no active bound holds, shape (p,), as are all arguments."""
    return np.asarray(~(((x <= low) & (gradient >= 0)) | ((x >= high) & (gradient <= 0))))


def _step(
    residual: FloatArray,
    jacobian: FloatArray,
    x: FloatArray,
    low: FloatArray,
    high: FloatArray,
    damping: float,
) -> FloatArray:
    step = np.zeros_like(x)
    gradient = jacobian.T @ residual
    moves = free(gradient, x, low, high)
    if not moves.any():
        return step
    J = jacobian[:, moves]
    scale = np.sqrt(np.einsum("ij,ij->j", J, J)) + 1e-300
    J = J / scale
    normal = J.T @ J
    normal.flat[:: len(normal) + 1] *= 1 + damping
    step[moves] = -_solved(normal, gradient[moves] / scale) / scale
    return step


def _solved(normal: FloatArray, right: FloatArray) -> FloatArray:
    """Solve by elimination; of a singular system, the least solution."""
    try:
        return np.asarray(np.linalg.solve(normal, right))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(normal, right, rcond=1e-14)[0])

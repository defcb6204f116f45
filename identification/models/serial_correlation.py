"""Errors of a sweep's lines that are correlated along frequency, and what they add to a covariance.

A sweep passes neighbouring frequencies one after the other. Gusts change the speed over seconds, the
gain changes with the speed, and so the gain errors of neighbouring lines are correlated: on simulated
trials 0.39, 0.37, 0.28 and 0.09 at 1, 2, 3 and 5 independent lines. A fit that takes them for
independent states intervals that are too narrow.

The normalised gain errors are white noise of variance `white` and a smooth part of variance theta with
the correlation exp(-k^2 / (2 LENGTH^2)) at k lines. theta is found by the method of moments from the
products of neighbouring residuals, with what the fit itself does to them: with the residual maker
R = I - H (H the hat matrix) and B the sum over 1 to 3 lines,

    E[r' B r] = white tr(R B R) + theta tr(R B R K)

One run determines theta poorly. So a part of it is taken as known from simulated trials (`SERIAL` of a
sweep's lines), and the excess of r' B r over what both parts explain is shrunk by 1 - 1 / t^2, t its ratio
to its standard deviation (positive-part James and Stein): chance widens no interval. Then the covariance
of the parameters is A J' (white I + theta K) J A with A = (J' J)^-1, the sandwich of least squares under
another covariance (Davidson and MacKinnon, Econometric Theory and Methods, section 5.5).
"""

import numpy as np

from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

LENGTH = 2.5  # independent lines
NEIGHBOURS = (1, 2, 3)  # lines whose products are used


def serial_covariance(
    value: ComplexArray,
    residual: ComplexArray,
    slopes: ComplexArray,
    inner: FloatArray,
    weight: FloatArray,
    white: float,
    expected: float = 0.0,
) -> FloatArray:
    """Covariance of the parameters, (p, p), under white and smooth errors of the gain.

    value: (n,) of the model; residual: (n,) and slopes: (n, p), normalised by the deviations; inner:
    (p, p), inverse of the normal matrix; weight: (n,) over the deviation of each line; white: variance
    of the normalised errors, 1; expected: variance of the smooth part over it, known beforehand, 1.
    """
    n = value.size
    turn = np.conj(value) / np.maximum(np.abs(value), 1e-300)  # real part: gain, imaginary: phase
    along = slopes * turn[:, None]
    J = np.vstack((along.real, along.imag))
    z = np.concatenate(((residual * turn).real, (residual * turn).imag))
    away = np.abs(np.arange(n)[:, None] - np.arange(n))
    size = np.abs(value) * weight
    K, B = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n))
    K[:n, :n] = np.exp(-(away**2) / (2 * LENGTH**2)) * np.outer(size, size) / np.mean(size**2)
    B[:n, :n] = 0.5 * np.isin(away, NEIGHBOURS)
    R = np.eye(2 * n) - J @ inner @ J.T
    M = R @ B @ R
    smooth = expected * white
    excess = float(z @ M @ z) - white * float(np.trace(M)) - smooth * float(np.sum(M * K))
    by_chance = 2 * white**2 * float(np.sum(M * M))  # variance of the excess
    shrinkage = max(0.0, 1 - by_chance / excess**2) if excess > 0 else 0.0
    information, most = float(np.sum(M * K)), 2 * float(z @ z) / max(2 * n - inner.shape[0], 1)
    # Smooth errors hold no more than all residuals do; few lines beside many parameters carry no
    # information on them.
    theta = smooth + (min(shrinkage * excess / information, most) if information > 0 else 0.0)
    return np.asarray(inner @ (white * (J.T @ J) + theta * (J.T @ K @ J)) @ inner)

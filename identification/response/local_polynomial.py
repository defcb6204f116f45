"""Frequency response of one record under a broad excitation, such as a sweep.

Over a narrow window of DFT lines the response G and the transient T of the record's ends are
smooth, so each is taken as a parabola:
Y(k + r) = (g0 + g1 r + g2 r^2) U(k + r) + t0 + t1 r + t2 r^2 + V.
Least squares in each window gives G, the residual noise, and from both the coherence: no
taper, no leakage, no averaging over a resonance (Pintelon and Schoukens, System Identification: A
Frequency Domain Approach, 2nd ed., chapter 7).
"""

import numpy as np
import numpy.typing as npt
from scipy import stats

from slipbench.identification.response.response import ComplexArray, FrequencyResponse
from slipbench.protocol.recording.channel import FloatArray

WINDOW = 0.4  # Hz, half width of the window of lines
FEWEST = 8  # lines on each side
LINES = 160  # at which the response is given
ORDER = 3  # terms in each of the polynomials


def sweep_response(
    u: FloatArray,
    y: FloatArray,
    rate: float,
    band: tuple[float, float],
    names: tuple[str, str] = ("u", "y"),
    half_width: float = WINDOW,
) -> FrequencyResponse:
    """Estimate the response of y to u over a band.

    u, y: (n,), without unknown samples; rate: Hz; band: Hz, lowest and highest excited frequency;
    half_width: Hz, of the window of lines.
    Raises ValueError where the record is too short for the band.
    """
    resolution = rate / u.size
    half = max(FEWEST, round(half_width / resolution))
    lowest = max(1, int(np.ceil(band[0] / resolution)))
    highest = min(u.size // 2, int(np.floor(band[1] / resolution)))
    if highest - lowest < 2 * half:
        raise ValueError(f"{u.size / rate:.1f} s are too short for {band[0]:g} to {band[1]:g} Hz")
    step = max(1, (highest - lowest) // LINES)
    centres = np.arange(lowest, highest + 1, step)
    first = np.clip(centres - half, lowest, highest - 2 * half)
    window = first[:, None] + np.arange(2 * half + 1)
    r = (window - centres[:, None]) / half
    U, Y = (np.fft.rfft(x - np.mean(x))[window] for x in (u, y))
    g, deviation, coherence, freedom = _local_fit(U, Y, r)
    return FrequencyResponse(
        *names,
        np.asarray(centres * resolution, dtype=np.float64),
        g,
        coherence,
        deviation,
        float(stats.t.ppf(0.975, 2 * freedom)),
        f"local polynomial, windows of {(2 * half + 1) * resolution:.3g} Hz",
        max(1, round(half / step)),  # there a parabola's weights are orthogonal to their shift
    )


def _local_fit(
    U: ComplexArray, Y: ComplexArray, r: FloatArray
) -> tuple[ComplexArray, FloatArray, FloatArray, int]:
    """Fit all windows at once. U, Y, r: (windows, lines). Returns G, its deviation, coherence."""
    powers: ComplexArray = (r[..., None] ** np.arange(ORDER)).astype(np.complex128)
    size = np.sqrt(np.mean(np.abs(U) ** 2, axis=1, keepdims=True)) + 1e-300
    regressors: ComplexArray = np.concatenate(((U / size)[..., None] * powers, powers), axis=2)
    freedom = U.shape[1] - 2 * ORDER
    solve: ComplexArray = np.linalg.pinv(regressors).astype(np.complex128)
    coefficients: ComplexArray = np.einsum("wij,wj->wi", solve, Y)
    noise = _left(Y, regressors, coefficients) / freedom
    transient: ComplexArray = np.einsum("wij,wj->wi", np.linalg.pinv(powers), Y)
    power = _left(Y, powers, transient) / (U.shape[1] - ORDER)
    g = coefficients[:, 0] / size[:, 0]
    leverage = np.sum(np.abs(solve[:, 0, :]) ** 2, axis=1)
    deviation = np.sqrt(noise * leverage) / size[:, 0]
    coherence = np.clip(1 - noise / np.maximum(power, 1e-300), 0.0, 1.0)
    return g, deviation, coherence, freedom


def _left(
    Y: ComplexArray, regressors: ComplexArray, coefficients: ComplexArray
) -> npt.NDArray[np.float64]:
    residual = Y - np.einsum("wij,wj->wi", regressors, coefficients)
    return np.asarray(np.sum(np.abs(residual) ** 2, axis=1))

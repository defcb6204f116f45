"""Filters that move nothing in time: low pass, and a notch that follows the wheel.

The 1X line of an encoder is a wave locked to the wheel's angle. Turned back by that angle it
stands still; what is slow there is the line. It is turned forward again and taken off. With a
first-order filter for "slow" this is the second-order notch that follows the wheel frequency
(Corno and Savaresi 2009), without coefficients that change in time; run forwards and backwards it
has no phase.
"""

import numpy as np
from scipy import signal

from slipbench.controllers.causal_filters import SMOOTH, WIDTH
from slipbench.protocol.recording.channel import FloatArray


def low_pass(value: FloatArray, rate: float, cutoff: float) -> FloatArray:
    """Low-pass filtered signal without phase, shape (n,): Butterworth, fourth order, both directions.

    rate, cutoff: Hz. Unknown samples stay NaN.
    """
    known = np.isfinite(value)
    if cutoff >= 0.45 * rate or np.count_nonzero(known) < 16:
        return value
    sections = signal.butter(4, cutoff, fs=rate, output="sos")
    settle = min(int(2 * rate / cutoff), value.size - 1)
    smooth = np.asarray(signal.sosfiltfilt(sections, bridged(value), padlen=settle))
    return np.where(known, smooth, np.nan)


def wheel_frequency(speed: FloatArray, rate: float, radius: float) -> FloatArray:
    """Turns in a second, through a 1 Hz low pass. speed: m/s, (n,); radius: m. Returns Hz."""
    return low_pass(speed, rate, SMOOTH) / (2 * np.pi * radius)


def rolling_line(
    value: FloatArray, frequency: FloatArray, rate: float, order: int = 1, width: float = WIDTH
) -> FloatArray:
    """Estimate the component of `value` that turns with the wheel, `order` times a turn.

    frequency: Hz, (n,), the wheel's; width: Hz. Returns the line alone, in the unit of `value`.
    """
    angle = order * 2 * np.pi * np.cumsum(bridged(frequency)) / rate
    filled = bridged(value)
    turned = (filled - low_pass(filled, rate, SMOOTH)) * np.exp(-1j * angle)
    b, a = signal.butter(1, width, fs=rate)
    settle = min(int(3 * rate / width), value.size - 1)
    still = signal.filtfilt(b, a, turned, padlen=settle, padtype="even")
    return np.asarray(2 * np.real(still * np.exp(1j * angle)))


def notch(
    value: FloatArray, frequency: FloatArray, rate: float, order: int = 1, width: float = WIDTH
) -> FloatArray:
    """Signal without the line of one wheel order, shape (n,); unknown samples stay NaN.

    frequency: of the wheel, Hz, shape (n,); rate, width: Hz.
    """
    line = rolling_line(value, frequency, rate, order, width)
    return np.where(np.isfinite(value), value - line, np.nan)


def line_reduction(before: FloatArray, after: FloatArray, angle: FloatArray) -> float:
    """Reduction of the component exp(j angle), dB, positive where it got smaller."""
    wave = np.exp(-1j * angle)
    amplitude = [abs(np.mean((x - np.mean(x)) * wave)) for x in (before, after)]
    return float(20 * np.log10(amplitude[0] / max(amplitude[1], 1e-300)))


def bridged(value: FloatArray) -> FloatArray:
    """Signal with unknown samples interpolated linearly, shape (n,), for filters and transforms."""
    known = np.isfinite(value)
    if known.all() or not known.any():
        return np.nan_to_num(value) if not known.any() else value
    index = np.arange(value.size)
    return np.interp(index, index[known], value[known])

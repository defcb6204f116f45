"""Resonance of a measured frequency response, reported only where the measurement carries it."""

import math
from dataclasses import dataclass

import numpy as np

from slipbench.identification.response.response import FrequencyResponse
from slipbench.protocol.recording.channel import FloatArray

FALLS_TO = 0.84  # of the peak, 1.5 dB: beyond a resonance the gain comes down again
LOW_SHARE = 0.06  # of the band, from below: there the low-frequency gain is read


@dataclass(frozen=True)
class Resonance:
    """frequency: Hz. peak: gain there over the low-frequency gain. low_gain: output per input."""

    frequency: float
    peak: float
    low_gain: float


@dataclass(frozen=True)
class NoResonance:
    """Why no resonance is given."""

    reason: str


def resonance(response: FrequencyResponse) -> Resonance | NoResonance:
    """Find the highest gain inside the band and check that it stands out of the error bands."""
    lines = response.reliable
    if np.count_nonzero(lines) < 5:
        return NoResonance("too few lines have enough coherence")
    frequency, gain = response.frequency[lines], response.gain[lines]
    band = response.gain_band[lines]
    low = frequency <= frequency[0] + LOW_SHARE * (frequency[-1] - frequency[0])
    low_gain = float(np.median(gain[low]))
    top = int(np.argmax(gain))
    if top in (0, frequency.size - 1):
        where = "lower" if top == 0 else "upper"
        return NoResonance(f"the gain is highest at the {where} end of the reliable band")
    if gain[top:].min() > FALLS_TO * gain[top]:
        return NoResonance("the gain does not fall again inside the reliable band")
    if gain[top] - band[top] <= low_gain + float(np.median(band[low])):
        return NoResonance("the highest gain does not stand out of the confidence band")
    at, height = _summit(frequency, np.log(gain), top)
    return Resonance(at, float(np.exp(height)) / low_gain, low_gain)


def low_frequency_delay(response: FrequencyResponse, peak: float = math.inf) -> float:
    """Delay that the phase slope shows over the lower half of the reliable band, s.

    It includes bus, servo, intake and driveline. peak: Hz, of a resonance; above half of it the phase turns
    with the resonance. Raises ValueError where fewer than three lines are reliable.
    """
    lines = response.reliable
    frequency, phase = response.frequency[lines], response.phase[lines]
    if frequency.size < 3:
        raise ValueError("fewer than three lines have enough coherence")
    below = np.count_nonzero(frequency <= 0.5 * peak)
    lower = slice(0, max(3, min(frequency.size // 2, below)))
    slope = np.polyfit(2 * np.pi * frequency[lower], phase[lower], 1)[0]
    return -float(slope)


def _summit(x: FloatArray, y: FloatArray, top: int) -> tuple[float, float]:
    """Vertex of the parabola through a few points about the highest."""
    reach = max(1, x.size // 40)
    near = slice(max(top - reach, 0), top + reach + 1)
    a, b, c = np.polyfit(x[near] - x[top], y[near], 2)
    if a >= 0:
        return float(x[top]), float(y[top])
    shift = float(np.clip(-b / (2 * a), x[near][0] - x[top], x[near][-1] - x[top]))
    return float(x[top]) + shift, float(c + b * shift + a * shift**2)

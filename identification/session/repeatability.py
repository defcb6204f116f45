"""Distance of two frequency responses of one trial, against what their intervals allow."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from slipbench.identification.response.describing_function import between
from slipbench.identification.response.response import ComplexArray, FrequencyResponse
from slipbench.protocol.recording.channel import FloatArray

FEWEST = 3  # independent lines that both runs must have


@dataclass(frozen=True)
class Repeatability:
    """Difference of two responses.

    distance  root mean square of the difference over the gain, 1
    expected  the same where only the noise of both differs, 1
    chance    probability of at least this difference by noise alone
    lines     independent lines that were compared
    """

    distance: float
    expected: float
    chance: float
    lines: int


def repeatability(new: FrequencyResponse, known: FrequencyResponse) -> Repeatability | None:
    """Distance over the lines that are reliable in both; None where these are too few.

    Under noise alone the squared differences, each over the sum of both variances, have twice the
    number of lines as degrees of freedom (chi-squared; complex normal lines).
    """
    value, deviation, reliable = at_frequencies(known, new.frequency)
    kept = np.flatnonzero(reliable & new.reliable)[:: max(new.stride, known.stride)]
    if kept.size < FEWEST:
        return None
    difference = np.abs(new.value - value)[kept]
    noise = np.hypot(new.deviation, deviation)[kept]
    gain = np.abs(value)[kept]
    statistic = 2 * float(np.sum((difference / np.maximum(noise, 1e-300)) ** 2))
    return Repeatability(
        float(np.sqrt(np.mean((difference / gain) ** 2))),
        float(np.sqrt(np.mean((noise / gain) ** 2))),
        float(stats.chi2.sf(statistic, 2 * kept.size)),
        int(kept.size),
    )


def at_frequencies(
    of: FrequencyResponse, frequency: FloatArray
) -> tuple[ComplexArray, FloatArray, np.ndarray]:
    """Value, deviation and reliability at other frequencies, shape (n,) each. frequency: Hz, (n,).

    Outside the frequencies of the response nothing is reliable.
    """
    inside = (frequency >= of.frequency[0]) & (frequency <= of.frequency[-1])
    nearest = np.interp(frequency, of.frequency, of.reliable.astype(float)) >= 1 - 1e-9
    return (
        between(frequency, of.frequency, of.value[None, :])[0],
        np.interp(frequency, of.frequency, of.deviation),
        inside & nearest,
    )

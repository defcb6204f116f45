"""Frequency response from runs that repeat one excitation, each begun at rest.

What differs between the runs is noise, and its deviation follows from their scatter. A run that is
cut off while its response still rings leaks; so each is continued by the free decay that a model
gives, and then the quotient of the spectra is the response (Pintelon and Schoukens, System
Identification: A Frequency Domain Approach, 2nd ed., section 2.5).
"""

import numpy as np
from scipy import stats

from slipbench.identification.response.response import FrequencyResponse
from slipbench.protocol.recording.channel import FloatArray

FEWEST = 3  # runs
EDGE = 0.01  # share of the input's power beyond each end of the band
ALIKE = 0.01  # of its swing, by which the input may differ from run to run


def repeats(u: FloatArray) -> bool:
    """Whether every run has the same input. u: shape (runs, n)."""
    return len(u) >= FEWEST and bool(np.max(np.ptp(u, axis=0)) <= ALIKE * np.ptp(u))


def excited_band(u: FloatArray, rate: float) -> tuple[float, float]:
    """Band that holds all but one percent of the inputs' power at each end, Hz. u: (runs, n)."""
    power = np.cumsum(np.sum(np.abs(np.fft.rfft(u - u[:, :1], axis=1)) ** 2, axis=0))
    low, high = np.searchsorted(power, (EDGE * power[-1], (1 - EDGE) * power[-1]))
    return float(max(low, 1) * rate / u.shape[1]), float(high * rate / u.shape[1])


def repeated_response(
    u: FloatArray, y: FloatArray, tail: FloatArray, rate: float, names: tuple[str, str]
) -> FrequencyResponse:
    """Divide mean spectra. u, y: (runs, n) about rest; tail: (m,) what y goes on with."""
    runs, n = u.shape
    u = np.pad(u, ((0, 0), (0, tail.size)), mode="edge") - u[:, -1:]
    y = np.concatenate((y, np.broadcast_to(tail, (runs, tail.size))), axis=1) - tail[-1]
    f = np.fft.rfftfreq(n + tail.size, 1 / rate)
    low, high = excited_band(u[:, :n], rate)
    step = max(1, round((n + tail.size) / n))  # lines closer than 1 / T share their noise
    inside = np.flatnonzero((f >= low) & (f <= high))[::step]
    U, Y = (np.fft.rfft(x, axis=1)[:, inside] for x in (u, y))
    input = U.mean(axis=0)
    noise = np.var(Y, axis=0, ddof=1)
    power = np.abs(Y.mean(axis=0)) ** 2
    frequency = np.asarray(f[inside], dtype=np.float64)
    return FrequencyResponse(
        *names,
        frequency,
        Y.mean(axis=0) / input,
        power / (power + noise),
        np.sqrt(noise / runs) / np.abs(input),
        float(stats.t.ppf(0.975, 2 * (runs - 1))),
        f"mean of {runs} runs of one excitation, each continued by its free decay",
    )

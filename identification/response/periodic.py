"""Frequency response under a periodic excitation: a multisine, or a square wave at its harmonics.

Each period is one experiment. At the excited lines the periods are averaged, and what differs
between them is noise: the response, its deviation and the coherence follow from their scatter.
"""

import numpy as np
from scipy import stats

from slipbench.identification.response.response import ComplexArray, FrequencyResponse
from slipbench.protocol.recording.channel import FloatArray

FEWEST_PERIODS = 3  # one to settle, two to compare
STRONG = 0.02  # of the strongest line's amplitude; weaker lines of a square wave are left out


def periodic_response(
    u: FloatArray,
    y: FloatArray,
    rate: float,
    period: float,
    harmonics: FloatArray,
    names: tuple[str, str] = ("u", "y"),
) -> FrequencyResponse:
    """Estimate the response of y to u at harmonics of 1 / period.

    u, y: (n,), from the start of the excitation to its end, without unknown samples; rate: Hz;
    period: s; harmonics: whole numbers. The first period is left out: there the response settles.
    Raises ValueError where there are fewer than three periods.
    """
    count = int(np.floor(u.size / (rate * period) + 1e-6))
    if count < FEWEST_PERIODS:
        raise ValueError(f"{count} periods of {period:g} s, at least {FEWEST_PERIODS} are needed")
    U, Y = (_lines(x, rate, period, count, harmonics) for x in (u, y))
    strong = np.abs(U.mean(axis=0)) >= STRONG * np.abs(U.mean(axis=0)).max()
    U, Y, kept = U[:, strong], Y[:, strong], harmonics[strong]
    g = np.sum(Y * U.conj(), axis=0) / np.sum(np.abs(U) ** 2, axis=0)
    residual_power = np.sum(np.abs(Y - g * U) ** 2, axis=0)
    deviation = np.sqrt(residual_power / (len(Y) - 1) / np.sum(np.abs(U) ** 2, axis=0))
    coherence = np.clip(
        1 - residual_power / np.maximum(np.sum(np.abs(Y) ** 2, axis=0), 1e-300), 0.0, 1.0
    )
    return FrequencyResponse(
        *names,
        kept / period,
        g,
        coherence,
        deviation,
        float(stats.t.ppf(0.975, 2 * (len(Y) - 1))),
        f"mean of {len(Y)} periods of {period:g} s",
    )


def _lines(
    x: FloatArray, rate: float, period: float, count: int, harmonics: FloatArray
) -> ComplexArray:
    """Fourier coefficients of every period but the first. Returns (count - 1, harmonics)."""
    length = round(rate * period)
    starts = [round(k * rate * period) for k in range(1, count)]
    starts = [start for start in starts if start + length <= x.size]
    parts = np.stack([x[start : start + length] for start in starts])
    parts = parts - _drift(parts)[:, None] * np.arange(length) / length
    wave = np.exp(-2j * np.pi * np.outer(np.arange(length) / (rate * period), harmonics))
    return np.asarray(2 / length * parts @ wave)


def _drift(parts: FloatArray) -> FloatArray:
    """Drift over one period, the same for all: from the means of whole periods.

    A straight line through each period would take a part of the response with it.
    """
    means = parts.mean(axis=1)
    slope = np.polyfit(np.arange(means.size), means, 1)[0] if means.size > 1 else 0.0
    return np.full(means.size, slope)

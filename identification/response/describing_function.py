"""Describing functions: harmonics of the output per amplitude of the input, from a sliced sweep.

A sweep is cut into slices of a few whole periods, in which its frequency counts as constant. With
u = A cos(phi) the output is y = sum over k of |G_k| A cos(k phi + arg G_k), and the Fourier
coefficients over the slice, 2 / T times the integral of y exp(-j k w t), give G_k (Corno and
Savaresi, SYSID 2009, equations 1 and 2). The scatter of neighbouring slices and of runs is the
error.

    runs = [swept_run_of(identify(read(folder))) for folder in folders]
    found = sliced([run for run in runs if isinstance(run, SweptRun)])
    found.gain[1]       # second harmonic, output per input amplitude, at found.frequency
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import stats

from slipbench.identification.response.response import ComplexArray
from slipbench.identification.response.swept_run import SweptRun
from slipbench.protocol.recording.channel import FloatArray

HARMONICS = 3
PERIODS = 4  # in a slice
NEIGHBOURS = 3  # slices on each side, from whose scatter the error follows
FEWEST_SLICES = 2 * NEIGHBOURS + 1


@dataclass(frozen=True)
class DescribingFunction:
    """Harmonics of an output per amplitude of an input, over the frequency of the excitation.

    input, output  roles
    frequency      (n,) Hz of the excitation, increasing
    value          (h, n) complex, row k - 1 the k-th harmonic per input amplitude; its phase is
                   counted from k times the phase of the input's cosine
    deviation      (h, n) standard deviation of the complex value
    quantile       two-sided 95 % quantile that belongs to `deviation`'s degrees of freedom
    amplitude      (n,) of the input, in its unit
    runs           number of runs that were averaged
    method         how it was estimated, for people
    """

    input: str
    output: str
    frequency: FloatArray
    value: ComplexArray
    deviation: FloatArray
    quantile: float
    amplitude: FloatArray
    runs: int
    method: str

    @property
    def gain(self) -> FloatArray:
        """Amplitude of each harmonic per amplitude of the input, (h, n)."""
        return np.asarray(np.abs(self.value))

    @property
    def phase(self) -> FloatArray:
        """Phase in rad, unwrapped along the frequency, (h, n)."""
        return np.unwrap(np.angle(self.value), axis=1)

    @property
    def gain_band(self) -> FloatArray:
        """Half width of the 95 % band of the gain, (h, n)."""
        return np.asarray(self.quantile * self.deviation / np.sqrt(2))

    @property
    def phase_band(self) -> FloatArray:
        """Half width of the 95 % band of the phase, rad, at most pi."""
        ratio = self.gain_band / np.maximum(self.gain, 1e-300)
        return np.where(ratio < 1, np.arcsin(np.minimum(ratio, 1)), np.pi)


@dataclass(frozen=True)
class NoHarmonics:
    """Why no harmonics are given."""

    reason: str


def sliced(
    runs: Sequence[SweptRun], count: int = HARMONICS, periods: int = PERIODS
) -> DescribingFunction | NoHarmonics:
    """Cut each run into slices of whole periods and average the runs."""
    if not runs:
        return NoHarmonics("no run with a sweep")
    slices = [_slices(run, count, periods) for run in runs]
    least = min(frequency.size for frequency, *_ in slices)
    if least < FEWEST_SLICES:
        return NoHarmonics(f"{least} slices of {periods} periods; {FEWEST_SLICES} are needed")
    frequency = _common([f for f, *_ in slices])
    value = np.stack([between(frequency, f, g) for f, g, _ in slices])
    amplitude = np.mean([np.interp(frequency, f, a) for f, _, a in slices], axis=0)
    turned = value * np.stack([against_delay(frequency, row) for row in value.mean(axis=0)])
    deviation, freedom = _scatter(turned)
    return DescribingFunction(
        runs[0].input,
        runs[0].output,
        frequency,
        value.mean(axis=0),
        deviation,
        float(stats.t.ppf(0.975, 2 * freedom)),
        amplitude,
        len(runs),
        f"slices of {periods} periods, {len(runs)} run{'s' if len(runs) > 1 else ''}",
    )


def between(at: FloatArray, frequency: FloatArray, value: ComplexArray) -> ComplexArray:
    """Values at other frequencies: straight lines of gain and of unwrapped phase. value: (h, n)."""
    gain, phase = np.abs(value), np.unwrap(np.angle(value), axis=1)
    rows = [
        np.interp(at, frequency, g) * np.exp(1j * np.interp(at, frequency, p))
        for g, p in zip(gain, phase, strict=True)
    ]
    return np.asarray(rows)


def against_delay(frequency: FloatArray, value: ComplexArray) -> ComplexArray:
    """Turn back by the mean slope of the phase, after which neighbours are similar. value: (n,)."""
    slope = np.polyfit(frequency, np.unwrap(np.angle(value)), 1, w=np.abs(value) + 1e-300)[0]
    return np.asarray(np.exp(-1j * slope * frequency))


def per_amplitude(output: ComplexArray, first: ComplexArray) -> ComplexArray:
    """Harmonics per input amplitude. output: (h, n), of exp(j k phi); first: (n,), the input's."""
    order = np.arange(1, len(output) + 1)[:, None]
    return np.asarray(output / np.abs(first) * np.exp(-1j * order * np.angle(first)))


def _slices(run: SweptRun, count: int, periods: int) -> tuple[FloatArray, ComplexArray, FloatArray]:
    """Frequency (m,), harmonics per amplitude (count, m) and input amplitude (m,) of slices."""
    turn = run.sweep.phase / (2 * np.pi * periods)
    edges = np.searchsorted(turn, np.arange(np.ceil(turn[0]), np.floor(turn[-1]) + 1e-9))
    parts = [slice(a, b) for a, b in pairwise(edges)]
    found = [_coefficients(run, part, count, periods) for part in parts]
    if not found:
        return np.empty(0), np.empty((count, 0), complex), np.empty(0)
    frequency, y, u = (np.asarray(x) for x in zip(*found, strict=True))
    order = np.argsort(frequency)
    return frequency[order], per_amplitude(y.T, u)[:, order], np.abs(u)[order]


def _coefficients(
    run: SweptRun, part: slice, count: int, periods: int
) -> tuple[float, ComplexArray, complex]:
    """Fourier coefficients over one slice, its frequency being the mean one (equation 1)."""
    n = part.stop - part.start
    wave = np.exp(-2j * np.pi * periods * np.outer(np.arange(1, count + 1), np.arange(n)) / n)
    y, u = run.y[part], run.u[part]
    return periods * run.rate / n, 2 / n * wave @ y, complex(2 / n * wave[0] @ u)


def _common(frequencies: Sequence[FloatArray]) -> FloatArray:
    """Slices of the first run, as far as all runs reach."""
    low, high = max(f[0] for f in frequencies), min(f[-1] for f in frequencies)
    tolerance = 1e-3 * (high - low)
    first = frequencies[0]
    return np.asarray(first[(first >= low - tolerance) & (first <= high + tolerance)])


def _scatter(value: ComplexArray) -> tuple[FloatArray, int]:
    """Deviation of the runs' mean, and its freedom, from what a parabola through a few
    neighbouring slices of all runs leaves. value: (runs, h, n)."""
    runs, _, n = value.shape
    width = 2 * NEIGHBOURS + 1
    first = np.clip(np.arange(n) - NEIGHBOURS, 0, n - width)
    near = value[:, :, first[:, None] + np.arange(width)]
    smooth = np.polynomial.polynomial.polyvander(np.linspace(-1, 1, width), 2)
    residual = near - near.mean(axis=0) @ (smooth @ np.linalg.pinv(smooth)).T
    freedom = runs * width - 3
    return np.sqrt(np.sum(np.abs(residual) ** 2, axis=(0, 3)) / freedom / runs), freedom

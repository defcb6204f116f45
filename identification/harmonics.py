"""Harmonics by least squares along the phase of the excitation.

The phase phi(t) of a sweep is known from the command itself. The output is a slow trend and waves
that are locked to it, whose amplitudes vary smoothly:

    y(t) = a_0(t) + sum over k of Re(a_k(t) exp(j k phi(t))) + e(t)

Each a_k is a cubic spline, its knots a few periods and a fraction of a Hz of the sweep apart; all
are found in one linear least squares, so that neither the trend nor one harmonic leaks into another
and no slice has to be stationary. A sweep is late: where H is what a wave passes on its way,
a_k = H - (j/2) k w' H'' (stationary phase, w' the sweep's rate), which is put back.

The noise e is not white. Its density beside each harmonic, where neither the splines nor the other
harmonics reach, gives the error.

    found = harmonics([run for run in runs if isinstance(run, SweptRun)])   # DescribingFunction
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import interpolate, sparse, stats

from identification.describing_function import (
    HARMONICS,
    DescribingFunction,
    NoHarmonics,
    per_amplitude,
)
from identification.response import ComplexArray
from identification.swept_run import SweptRun
from protocol.channel import FloatArray

RESOLUTION = 0.5  # Hz of the excitation between knots
PERIODS = 2.5  # between knots, at least
FEWEST_PIECES = 4
LINES = 120
BESIDE = (3, 4, 5)  # quarters of 1 / piece, off a harmonic, where only noise is left
DEGREE = 3


@dataclass(frozen=True)
class Amplitudes:
    """Amplitudes of one signal's harmonics at some frequencies of the sweep.

    value      (h, n) complex, of exp(j k phi)
    deviation  (h, n) standard deviation of the complex value
    """

    value: ComplexArray
    deviation: FloatArray


def harmonics(
    runs: Sequence[SweptRun], count: int = HARMONICS, resolution: float = RESOLUTION
) -> DescribingFunction | NoHarmonics:
    """Estimate harmonics per input amplitude, averaged over runs. resolution: Hz."""
    if not runs:
        return NoHarmonics("no run with a sweep")
    low = max(float(run.sweep.frequency.min()) for run in runs)
    high = min(float(run.sweep.frequency.max()) for run in runs)
    pieces = min(_pieces(run, resolution)[-1] for run in runs)
    if pieces < FEWEST_PIECES or not high > low:
        return NoHarmonics(f"the sweeps share {pieces:.1f} pieces of {PERIODS:g} periods, "
                           f"{FEWEST_PIECES} are needed")  # fmt: skip
    at = np.linspace(low, high, LINES)
    value, deviation, amplitude = _averaged(runs, at, count, resolution)
    freedom = len(BESIDE) * 2 * len(runs)
    return DescribingFunction(
        runs[0].input, runs[0].output, at, value, deviation,
        float(stats.t.ppf(0.975, 2 * freedom)), amplitude, len(runs),
        f"least squares along the phase, {len(runs)} run{'s' if len(runs) > 1 else ''}",
    )  # fmt: skip


def _averaged(
    runs: Sequence[SweptRun], at: FloatArray, count: int, resolution: float
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    given = [amplitudes(run, run.u, at, count, resolution).value[0] for run in runs]
    taken = [amplitudes(run, run.y, at, count, resolution) for run in runs]
    value = np.mean([per_amplitude(y.value, u) for y, u in zip(taken, given, strict=True)], axis=0)
    variance = [(y.deviation / np.abs(u)) ** 2 for y, u in zip(taken, given, strict=True)]
    deviation = np.sqrt(np.sum(variance, axis=0)) / len(runs)
    return value, deviation, np.mean(np.abs(given), axis=0)


def amplitudes(
    run: SweptRun, signal: FloatArray, at: FloatArray, count: int, resolution: float = RESOLUTION
) -> Amplitudes:
    """Estimate the harmonics of one signal where the sweep passes the frequencies `at`, Hz."""
    time = np.arange(signal.size) / run.rate
    knots = _knots(time, _pieces(run, resolution))
    splines = interpolate.BSpline.design_matrix(time, knots, DEGREE)
    regressors = _regressors(splines, run.sweep.phase, count)
    inverse = np.linalg.inv((regressors.T @ regressors).toarray())
    weights = inverse @ (regressors.T @ signal)
    left = signal - regressors @ weights
    noise = _noise(left, run, knots, count)
    when = _passing(run, time, at)
    found = []
    for k in range(1, count + 1):
        shape = _settled(knots, run, when, k)
        m = shape.shape[1]
        own = slice((2 * k - 1) * m, 2 * k * m), slice(2 * k * m, (2 * k + 1) * m)
        spread = sum(inverse[part, part] for part in own)
        share = np.einsum("ti,ij,tj->t", shape.conj(), spread, shape).real
        deviation = np.sqrt(share * np.interp(when, *noise[k - 1]))
        found.append((shape @ (weights[own[0]] - 1j * weights[own[1]]), deviation))
    value, deviation = zip(*found, strict=True)
    return Amplitudes(np.asarray(value), np.asarray(deviation))


def _pieces(run: SweptRun, resolution: float) -> FloatArray:
    """Number of pieces between knots until each sample, (n,)."""
    frequency = run.sweep.frequency
    pace = np.abs(np.gradient(frequency)) * run.rate / resolution
    density = np.minimum(frequency / PERIODS, np.maximum(pace, 1e-9))
    return np.asarray(np.cumsum(density) / run.rate)


def _knots(time: FloatArray, pieces: FloatArray) -> FloatArray:
    inner = np.interp(np.linspace(0, pieces[-1], max(int(pieces[-1]), 1) + 1), pieces, time)
    inner[0], inner[-1] = time[0], time[-1]
    return np.concatenate((np.full(DEGREE, inner[0]), inner, np.full(DEGREE, inner[-1])))


def _regressors(splines: sparse.csr_array, phase: FloatArray, count: int) -> sparse.csr_array:
    """Splines, and splines times cosine and sine of each harmonic."""
    waves = [wave(k * phase) for k in range(1, count + 1) for wave in (np.cos, np.sin)]
    locked = [splines.multiply(wave[:, None]) for wave in waves]
    return sparse.csr_array(sparse.hstack([splines, *locked]))


def _passing(run: SweptRun, time: FloatArray, at: FloatArray) -> FloatArray:
    """When the sweep passes some frequencies, s."""
    order = np.argsort(run.sweep.frequency)
    return np.interp(at, run.sweep.frequency[order], time[order])


def _settled(knots: FloatArray, run: SweptRun, when: FloatArray, k: int) -> ComplexArray:
    """Weights of the k-th harmonic's splines at some times, the sweep's lateness put back.

    H = a + (j/2) k w' d2a/d(k w)2, with d/dw = (1/w') d/dt while w' is nearly constant.
    """
    pace = 2 * np.pi * np.gradient(run.sweep.frequency) * run.rate
    rate = np.interp(when, np.arange(pace.size) / run.rate, pace)
    unit = np.eye(knots.size - DEGREE - 1)
    splines = interpolate.BSpline(knots, unit, DEGREE)
    bend = splines(when, 2) / np.where(rate == 0, np.inf, rate)[:, None]
    return np.asarray(splines(when) + 0.5j / k * bend)


def _noise(
    left: FloatArray, run: SweptRun, knots: FloatArray, count: int
) -> list[tuple[FloatArray, FloatArray]]:
    """Variance of white noise as dense as the residual beside each harmonic: (time, variance)."""
    inner = np.unique(knots)
    centre, length = (inner[1:] + inner[:-1]) / 2, 4 * np.diff(inner)
    start = np.clip(centre - length / 2, 0, np.maximum(inner[-1] - length, 0))
    levels = np.array([
        [_beside(left, run, slice(int(a * run.rate), int((a + b) * run.rate)), k)
         for a, b in zip(start, length, strict=True)]
        for k in range(1, count + 1)
    ])  # fmt: skip
    near = np.pad(levels, ((0, 0), (1, 1)), mode="edge")
    smooth = (near[:, :-2] + near[:, 1:-1] + near[:, 2:]) / 3
    return [(centre, row) for row in smooth]


def _beside(left: FloatArray, run: SweptRun, part: slice, k: int) -> float:
    """Mean power of the residual a little off the k-th harmonic, as variance of white noise."""
    turned = left[part] * np.exp(-1j * k * run.sweep.phase[part])
    taper = np.hanning(turned.size)
    off = np.array([*BESIDE, *(-q for q in BESIDE)])
    waves = np.exp(-2j * np.pi * np.outer(off, np.arange(turned.size)) / turned.size)
    return float(np.mean(np.abs(waves @ (turned * taper)) ** 2) / np.sum(taper**2))

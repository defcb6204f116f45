"""Waves that are locked to a known phase and whose amplitudes vary smoothly, by least squares.

    y(t) = a_0(t) + sum over k of Re(a_k(t) exp(j k phi(t))) + e(t)

Every a_k is a cubic spline. Between two
knots only four splines live, so that the normal equations are gathered piece by piece.
"""

from dataclasses import dataclass

import numpy as np
from scipy import interpolate

from slipbench.identification.response.response import ComplexArray
from slipbench.identification.response.swept_run import SweptRun
from slipbench.protocol.recording.channel import FloatArray

PERIODS = 2.5  # between knots, at least
DEGREE = 3
BESIDE = (3, 4, 5)  # quarters of 1 / piece, off a harmonic, where only noise remains


@dataclass(frozen=True)
class Amplitudes:
    """Amplitudes of one signal's harmonics at some frequencies of the sweep.

    value      (h, m) complex, of exp(j k phi)
    deviation  (h, m) standard deviation of the complex value
    """

    value: ComplexArray
    deviation: FloatArray


def amplitudes(
    run: SweptRun, signals: tuple[FloatArray, ...], at: FloatArray, count: int, resolution: float
) -> tuple[Amplitudes, ...]:
    """Estimate `count` harmonics of some signals where the sweep passes `at`, Hz, (m,)."""
    time = np.arange(run.y.size) / run.rate
    knots = _knots(time, pieces(run, resolution))
    order = np.argsort(run.sweep.frequency)
    when = np.interp(at, run.sweep.frequency[order], time[order])
    inverse, weights, residuals = _solved(run, np.stack(signals, axis=1), time, knots, count)
    shapes = [_settled(knots, run, when, k) for k in range(1, count + 1)]
    return tuple(
        _read(inverse, w, shapes, when, _noise(e, run, knots, count))
        for w, e in zip(weights.T, residuals.T, strict=True)
    )


def left_of(run: SweptRun, signal: FloatArray, resolution: float = 0.5) -> FloatArray:
    """Residual of a signal of the run after a trend and its own wave along the phase, (n,)."""
    time = np.arange(run.y.size) / run.rate
    knots = _knots(time, pieces(run, resolution))
    return np.asarray(_solved(run, signal[:, None], time, knots, 1)[2][:, 0])


def pieces(run: SweptRun, resolution: float) -> FloatArray:
    """Number of pieces between knots until each sample, (n,). resolution: Hz of the sweep."""
    frequency = run.sweep.frequency
    pace = np.abs(np.gradient(frequency)) * run.rate / resolution
    density = np.minimum(frequency / PERIODS, np.maximum(pace, 1e-9))
    return np.asarray(np.cumsum(density) / run.rate)


def _knots(time: FloatArray, passed: FloatArray) -> FloatArray:
    inner = np.interp(np.linspace(0, passed[-1], max(int(passed[-1]), 1) + 1), passed, time)
    inner[0], inner[-1] = time[0], time[-1]
    return np.concatenate((np.full(DEGREE, inner[0]), inner, np.full(DEGREE, inner[-1])))


def _solved(
    run: SweptRun, signals: FloatArray, time: FloatArray, knots: FloatArray, count: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Inverse normal matrix, weights (waves of splines, s) and residuals (n, s)."""
    each = knots.size - DEGREE - 1
    gram = np.zeros(((2 * count + 1) * each,) * 2)
    right = np.zeros((gram.shape[0], signals.shape[1]))
    blocks = []
    edges = np.searchsorted(time, knots[DEGREE + 1 : -DEGREE - 1])
    for first, rows in enumerate(np.split(np.arange(time.size), edges)):
        if not rows.size:
            continue
        splines = interpolate.BSpline.design_matrix(time[rows], knots, DEGREE).toarray()
        live = np.arange(first, first + DEGREE + 1)
        waves = _waves(run.sweep.phase[rows], count)
        block = (waves[:, :, None] * splines[:, None, live]).reshape(rows.size, -1)
        columns = (np.arange(2 * count + 1)[:, None] * each + live).ravel()
        gram[np.ix_(columns, columns)] += block.T @ block
        right[columns] += block.T @ signals[rows]
        blocks.append((rows, columns, block))
    inverse: FloatArray = np.linalg.inv(gram).astype(np.float64)
    weights = inverse @ right
    residuals = signals.astype(np.float64)
    for rows, columns, block in blocks:
        residuals[rows] -= block @ weights[columns]
    return inverse, weights, residuals


def _waves(phase: FloatArray, count: int) -> FloatArray:
    """One, and cosine and sine of each harmonic, (n, 2 count + 1)."""
    turns = [wave(k * phase) for k in range(1, count + 1) for wave in (np.cos, np.sin)]
    return np.stack([np.ones_like(phase), *turns], axis=1)


def _read(
    inverse: FloatArray,
    weights: FloatArray,
    shapes: list[ComplexArray],
    when: FloatArray,
    noise: list[tuple[FloatArray, FloatArray]],
) -> Amplitudes:
    value, deviation = [], []
    for k, shape in enumerate(shapes, 1):
        m = shape.shape[1]
        cosine, sine = (slice(i * m, (i + 1) * m) for i in (2 * k - 1, 2 * k))
        spread = inverse[cosine, cosine] + inverse[sine, sine]
        share = np.sum((shape.conj() @ spread) * shape, axis=1).real
        value.append(shape @ (weights[cosine] - 1j * weights[sine]))
        deviation.append(np.sqrt(share * np.interp(when, *noise[k - 1])))
    return Amplitudes(np.asarray(value), np.asarray(deviation))


def _settled(knots: FloatArray, run: SweptRun, when: FloatArray, k: int) -> ComplexArray:
    """Weights of the k-th harmonic's splines at some times, the sweep's lateness put back.

    H = a + (j/2) k w' d2a/d(k w)2, with d/dw = (1/w') d/dt while w' is nearly constant.
    """
    pace = 2 * np.pi * np.gradient(run.sweep.frequency) * run.rate
    rate = np.interp(when, np.arange(pace.size) / run.rate, pace)
    splines = interpolate.BSpline(knots, np.eye(knots.size - DEGREE - 1), DEGREE)
    bend = splines(when, 2) / np.where(rate == 0, np.inf, rate)[:, None]
    return np.asarray(splines(when) + 0.5j / k * bend)


def _noise(
    residual: FloatArray, run: SweptRun, knots: FloatArray, count: int
) -> list[tuple[FloatArray, FloatArray]]:
    """Variance of white noise as dense as the residual beside each harmonic: (time, variance)."""
    inner = np.unique(knots)
    centre, length = (inner[1:] + inner[:-1]) / 2, 4 * np.diff(inner)
    start = np.clip(centre - length / 2, 0, np.maximum(inner[-1] - length, 0))
    parts = [
        slice(int(a * run.rate), int((a + b) * run.rate))
        for a, b in zip(start, length, strict=True)
    ]
    found = []
    for k in range(1, count + 1):
        levels = np.array([_beside(residual[part], k * run.sweep.phase[part]) for part in parts])
        near = np.pad(levels, 1, mode="edge")
        found.append((centre, (near[:-2] + near[1:-1] + near[2:]) / 3))
    return found


def _beside(residual: FloatArray, phase: FloatArray) -> float:
    """Mean power of the residual a little off a wave of some phase, as variance of white noise."""
    taper = np.hanning(residual.size)
    lines = np.fft.fft(
        residual * np.exp(-1j * phase) * taper
    )  # of four pieces: quarters of 1 / piece
    beside = lines[[*BESIDE, *(-q for q in BESIDE)]]
    return float(np.mean(np.abs(beside) ** 2) / np.sum(taper**2))

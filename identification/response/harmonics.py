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

    runs = [swept_run_of(identify(read(folder))) for folder in folders]
    found = harmonics([run for run in runs if isinstance(run, SweptRun)])   # DescribingFunction
"""

from collections.abc import Sequence

import numpy as np
from scipy import stats

from slipbench.identification.response.describing_function import (
    HARMONICS,
    DescribingFunction,
    NoHarmonics,
    per_amplitude,
)
from slipbench.identification.response.phase_locked import BESIDE, PERIODS, amplitudes, pieces
from slipbench.identification.response.response import ComplexArray
from slipbench.identification.response.swept_run import SweptRun
from slipbench.protocol.recording.channel import FloatArray

RESOLUTION = 0.5  # Hz of the excitation between knots
FEWEST_PIECES = 8
LINES = 120


def harmonics(
    runs: Sequence[SweptRun], count: int = HARMONICS, resolution: float = RESOLUTION
) -> DescribingFunction | NoHarmonics:
    """Estimate harmonics per input amplitude, averaged over runs. resolution: Hz."""
    if not runs:
        return NoHarmonics("no run with a sweep")
    ends = [_ends(run, resolution) for run in runs]
    low, high = max(low for low, _ in ends), min(high for _, high in ends)
    least = min(float(pieces(run, resolution)[-1]) for run in runs)
    if least < FEWEST_PIECES or not high > low:
        return NoHarmonics(
            f"the sweeps have {least:.1f} pieces of {PERIODS:g} periods or {resolution:g} Hz in "
            f"common, {FEWEST_PIECES} are needed"
        )
    at = np.linspace(low, high, LINES)
    value, deviation, amplitude = _averaged(runs, at, count, resolution)
    freedom = len(BESIDE) * 2 * len(runs)
    return DescribingFunction(
        runs[0].input,
        runs[0].output,
        at,
        value,
        deviation,
        float(stats.t.ppf(0.975, 2 * freedom)),
        amplitude,
        len(runs),
        f"least squares along the phase, {len(runs)} run{'s' if len(runs) > 1 else ''}",
    )


def _ends(run: SweptRun, resolution: float) -> tuple[float, float]:
    """Lowest and highest frequency, Hz, half a piece inside the sweep, where splines are held."""
    passed = pieces(run, resolution)
    inside = (passed > 0.5) & (passed < passed[-1] - 0.5)
    frequency = run.sweep.frequency[inside] if inside.any() else run.sweep.frequency
    return float(frequency.min()), float(frequency.max())


def _averaged(
    runs: Sequence[SweptRun], at: FloatArray, count: int, resolution: float
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Value and deviation (count, m), and input amplitude (m,), of the mean over runs."""
    values, variances, sizes = [], [], []
    for run in runs:
        u, y = amplitudes(run, (run.u, run.y), at, count, resolution)
        size = np.abs(u.value[0])
        values.append(per_amplitude(y.value, u.value[0]))
        variances.append((y.deviation / size) ** 2)
        sizes.append(size)
    deviation = np.sqrt(np.sum(variances, axis=0)) / len(runs)
    return np.mean(values, axis=0), deviation, np.mean(sizes, axis=0)

"""Frequency response pooled over repeats of one trial, with the scatter between runs in its interval."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from slipbench.identification.response.response import FrequencyResponse
from slipbench.identification.session.repeatability import at_frequencies


def pooled(responses: Sequence[FrequencyResponse]) -> FrequencyResponse:
    """Mean of responses of one trial, at the lines of the first that all of them have.

    Weights are equal, so that a run with little noise but another operating point does not decide.
    Where the runs differ by more than their own intervals allow, the deviation of the mean is
    multiplied by the Birge ratio, the root of chi-squared per degree of freedom over all lines (R. T.
    Birge, Phys. Rev. 40 (1932) 207). One response comes back as it is. Raises ValueError where none
    is given, or where they have no frequency in common.
    """
    if not responses:
        raise ValueError("no response to pool")
    first, runs = responses[0], len(responses)
    if runs == 1:
        return first
    low = max(one.frequency[0] for one in responses)
    high = min(one.frequency[-1] for one in responses)
    tolerance = 1e-3 * (high - low)
    kept = (first.frequency >= low - tolerance) & (first.frequency <= high + tolerance)
    if not kept.any():
        raise ValueError("the responses have no frequency in common")
    frequency = first.frequency[kept]
    found = [at_frequencies(one, np.clip(frequency, low, high)) for one in responses]
    value = np.stack([each[0] for each in found])
    deviation = np.stack([each[1] for each in found])
    mean = value.mean(axis=0)
    within = np.sqrt(np.sum(deviation**2, axis=0)) / runs
    stride = max(one.stride for one in responses)
    lines = np.flatnonzero(np.all([each[2] for each in found], axis=0))[::stride]
    freedom = (runs - 1) * max(lines.size, 1)
    excess = np.abs(value - mean)[:, lines] ** 2 / np.maximum(deviation[:, lines] ** 2, 1e-300)
    birge = float(np.sqrt(max(1.0, np.sum(excess) / freedom))) if lines.size else 1.0
    coherence = np.mean([np.interp(frequency, r.frequency, r.coherence) for r in responses], axis=0)
    return replace(
        first,
        frequency=frequency,
        value=mean,
        coherence=coherence,
        deviation=birge * within,
        quantile=max(
            min(one.quantile for one in responses), float(stats.t.ppf(0.975, 2 * freedom))
        ),
        method=f"mean of {runs} runs; Birge ratio {birge:.2f}",
        stride=stride,
    )

"""Validation of a model on data that it was not fitted to: NRMSE fit and residual tests.

    found = validated(identification, recommended)     # held-out blocks of the same run
    found = validated_on(recommended.fit, other_identification)   # another run

A sweep passes each frequency once, so its blocks are bands: the lines of a fold are left out, the same
order is fitted to the others, and predicts the time in which the sweep passed the lines left out. Any
other excitation repeats its band: the response is estimated anew from the first part of the excitation,
the same order is fitted, and predicts the rest. No prediction uses a measured output.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.models.rational_ml import RationalFit, fit_order
from slipbench.identification.models.recommended import Recommended
from slipbench.identification.models.residual_tests import (
    NoTests,
    ResidualTests,
    residual_tests,
    without_slow,
)
from slipbench.identification.models.time_check import fit_percent
from slipbench.identification.response.identify import Identification
from slipbench.identification.response.independent_lines import (
    Lines,
    NoRational,
    independent_lines,
    subset,
)
from slipbench.identification.response.responses import NoResponse, response_between
from slipbench.identification.response.swept_recording import signals_of, swept_run_of
from slipbench.identification.response.swept_run import SweptRun, moving
from slipbench.identification.signals.named import stated_unit, unit_of
from slipbench.identification.signals.swept_phase import NoSweep
from slipbench.identification.signals.trial_window import NoExcitation, TrialWindow
from slipbench.protocol.recording.channel import FloatArray

FOLDS, BLOCKS = 5, 10  # every fold holds two bands, so that only the outermost are extrapolated
TRAINED = 0.6  # share of the excitation that a repeated excitation is fitted to


@dataclass(frozen=True)
class Validation:
    """A model against held-out data of one run.

    run                  name of the run; held_out: which data, for people
    time                 (n,) s from the recording's start
    measured, predicted  (n,) output in SI, both without what is slower than the band
    fit                  NRMSE fit, %: 100 (1 - |measured - predicted| / |measured - mean|)
    error                root mean square of the residual, in the output's unit
    unit                 of the output, in SI; stated: by the source of the output, empty if by none
    """

    run: str
    held_out: str
    input: str
    output: str
    time: FloatArray
    measured: FloatArray
    predicted: FloatArray
    fit: float
    error: float
    tests: ResidualTests | NoTests
    unit: str
    stated: str = ""

    @property
    def missing(self) -> float:
        """Share of the output's amplitude that depends on the input and is not in the model.

        0 where the test of the cross-correlation passes or is not performed.
        """
        if isinstance(self.tests, NoTests) or self.tests.cross_correlation.passed:
            return 0.0
        return self.tests.cross_correlation.share * self.error / float(np.std(self.measured))


@dataclass(frozen=True)
class NoValidation:
    """Why a model is not validated."""

    input: str
    output: str
    reason: str


def validated(found: Identification, of: Recommended) -> Validation | NoValidation:
    """Validate a model of a run on held-out blocks of the same run."""
    given, taken = of.response.input, of.response.output
    if not isinstance(swept_run_of(found, given, taken), NoSweep):
        return _by_bands(found, of)
    return _by_time(found, of)


def validated_on(of: RationalFit, other: Identification) -> Validation | NoValidation:
    """Validate a model on another run, in the excitation of that run."""
    parts = signals_of(other, of.lines.input, of.lines.output)
    if isinstance(parts, NoSweep):
        return NoValidation(of.lines.input, of.lines.output, parts.reason)
    assert isinstance(other.window, TrialWindow)
    (u, y, _), _names = parts
    time = other.base.time[other.window.exciting]
    predicted = simulated(of, u, other.base.rate)
    return _compared(of.lines, other, "the whole excitation", time, u, y, predicted)


def simulated(of: RationalFit, u: FloatArray, rate: float) -> FloatArray:
    """Response of a fitted model to an input u, (n,) at `rate` Hz, with the drift below its band.

    The response that it was fitted to takes the input as it is at the samples, and straight lines
    between: the mean of two samples is held from one to the next.
    """
    value = of.model.simulate((u + np.append(u[1:], u[-1])) / 2, rate)
    return np.asarray(value + of.drift[0] * np.cumsum(value - value[0]) / rate)


def predicted_by_bands(run: SweptRun, of: RationalFit) -> FloatArray | None:
    """Response to a sweep, (n,), in each band by models that were not fitted to it.

    None where too few lines remain for the order.
    """
    lines = of.lines
    bounds = np.linspace(0, lines.frequency.size, BLOCKS + 1).round().astype(int)
    edges = lines.frequency[np.minimum(bounds, lines.frequency.size - 1)]
    block = np.clip(np.searchsorted(edges, run.sweep.frequency) - 1, 0, BLOCKS - 1)
    predicted = np.empty(run.u.size)
    for fold in range(FOLDS):
        kept = np.ones(lines.frequency.size, dtype=np.bool_)
        for held in range(fold, BLOCKS, FOLDS):
            kept[bounds[held] : bounds[held + 1]] = False
        if 2 * np.count_nonzero(kept) <= of.order.size:
            return None
        now = block % FOLDS == fold
        predicted[now] = simulated(fit_order(subset(lines, kept), of.order), run.u, run.rate)[now]
    return predicted


def _by_bands(found: Identification, of: Recommended) -> Validation | NoValidation:
    lines = of.fit.lines
    parts = signals_of(found, lines.input, lines.output)
    run = swept_run_of(found, lines.input, lines.output)
    assert not isinstance(parts, NoSweep)
    assert isinstance(run, SweptRun)
    assert isinstance(found.window, TrialWindow)
    predicted = predicted_by_bands(run, of.fit)
    if predicted is None:
        return NoValidation(lines.input, lines.output, "too few lines to leave some out")
    start = found.window.exciting.start + moving(parts[0][2]).start
    time = found.base.time[start : start + run.u.size]
    words = f"{BLOCKS} bands of this run in {FOLDS} folds"
    return _compared(lines, found, words, time, run.u, run.y, predicted)


def _by_time(found: Identification, of: Recommended) -> Validation | NoValidation:
    given, taken = of.response.input, of.response.output
    parts = signals_of(found, given, taken)
    if isinstance(parts, NoSweep):
        return NoValidation(given, taken, parts.reason)
    assert not isinstance(found.window, NoExcitation)
    part = found.window.exciting
    split = part.start + round(TRAINED * (part.stop - part.start))
    first = TrialWindow(
        slice(part.start, split),
        slice(found.window.record.start, split),
        found.window.trip,
        found.window.trip_time,
    )
    trained = response_between(
        found.base, found.motion, first, found.recording.trial, (given, taken)
    )
    lines = trained if isinstance(trained, NoResponse) else independent_lines(trained)
    if isinstance(lines, NoResponse | NoRational):
        return NoValidation(given, taken, f"the first {100 * TRAINED:.0f} % alone: {lines.reason}")
    if 2 * lines.frequency.size <= of.fit.order.size:
        return NoValidation(given, taken, f"the first {100 * TRAINED:.0f} % have too few lines")
    (u, y, _), _names = parts
    fit = fit_order(lines, of.fit.order)
    late = slice(split - part.start, None)
    predicted = simulated(fit, u, found.base.rate)[late]
    words = f"the last {100 * (1 - TRAINED):.0f} % of the excitation"
    return _compared(lines, found, words, found.base.time[part][late], u[late], y[late], predicted)


def _compared(
    lines: Lines,
    found: Identification,
    held_out: str,
    time: FloatArray,
    u: FloatArray,
    y: FloatArray,
    predicted: FloatArray,
) -> Validation:
    band = (float(lines.frequency[0]), float(lines.frequency[-1]))
    rate = found.base.rate
    measured, predicted = (without_slow(x, rate, band[0]) for x in (y, predicted))
    residual = measured - predicted
    return Validation(
        found.recording.folder.name,
        held_out,
        lines.input,
        lines.output,
        time,
        measured,
        predicted,
        fit_percent(measured, predicted),
        float(np.sqrt(np.mean(residual**2))),
        residual_tests(residual, u, rate, band),
        unit_of(lines.output, found.base),
        stated_unit(lines.output, found.base),
    )

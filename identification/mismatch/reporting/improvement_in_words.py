"""Report the held-out improvement over the re-calibrated system in sentences."""

from collections.abc import Sequence
from math import isfinite

from slipbench.identification.mismatch.reporting.improvement import (
    Change,
    Improvement,
    OutputImprovement,
)
from slipbench.identification.mismatch.simulation.written_units import WrittenUnits


def improvement_in_words(improvement: Improvement, headline: str, written: WrittenUnits) -> str:
    """Report which error decreases and by how much, or that no simulation error decreases.

    headline: output chosen on the training recordings, which is reported first.
    """
    first = _headline_output(improvement, headline)
    shown = shown_by(improvement, headline)
    rises = _increases([o for o in improvement.outputs if o.simulation.rises], written)
    if shown.simulation.falls:
        sentence = _decrease(shown, "simulation error", shown.simulation, written)
        return f"Held out, {sentence}; {rises}{log_likelihood(improvement)}."
    headline_change = first.simulation
    factor, unit = _factor_and_unit(first, written)
    no_decrease = (
        f"Held out, no simulation error falls measurably against the re-calibrated file"
        f" ({words(first.output)}: {factor * headline_change.calibrated:.4g} re-calibrated,"
        f" {factor * headline_change.improved:.4g}{unit} improved, {ratio(headline_change)})"
    )
    return f"{no_decrease}; {rises}{_finer_measure(shown, written)}{log_likelihood(improvement)}."


def shown_by(improvement: Improvement, headline: str) -> OutputImprovement:
    """Return the output whose simulation error, or else a finer error measure, decreases."""
    first = _headline_output(improvement, headline)
    for falls in (_simulation_falls, _in_band_falls, _one_step_falls):
        for o in (first, *sorted(improvement.outputs, key=lambda o: -o.share)):
            if falls(o):
                return o
    return first


def _headline_output(improvement: Improvement, headline: str) -> OutputImprovement:
    return improvement.of(headline) or improvement.differs_most


def _simulation_falls(o: OutputImprovement) -> bool:
    return o.simulation.falls


def _in_band_falls(o: OutputImprovement) -> bool:
    return o.in_band is not None and o.in_band.falls


def _one_step_falls(o: OutputImprovement) -> bool:
    return o.one_step.falls


def _increases(outputs: Sequence[OutputImprovement], written: WrittenUnits) -> str:
    sentences = []
    for o in outputs:
        factor, unit = _factor_and_unit(o, written)
        change = (
            f"{factor * o.simulation.calibrated:.3g} to {factor * o.simulation.improved:.3g}{unit}"
        )
        sentences.append(f"that of {words(o.output)} rises from {change} ({ratio(o.simulation)}); ")
    return "".join(sentences)


def _finer_measure(o: OutputImprovement, written: WrittenUnits) -> str:
    """Report the decrease of the error in the band or of the one-step error, if significant."""
    if o.band and o.in_band and o.in_band.falls:
        error = f"error from {o.band[0]:.3g} to {o.band[1]:.3g} Hz"
        return f"{_decrease(o, error, o.in_band, written)}; "
    if o.one_step.falls:
        return f"{_decrease(o, 'one-step error', o.one_step, written)}; "
    return ""


def _decrease(o: OutputImprovement, error: str, change: Change, written: WrittenUnits) -> str:
    factor, unit = _factor_and_unit(o, written)
    return (
        f"the {error} of {words(o.output)} falls by {fall(change)} against the re-calibrated file,"
        f" from {factor * change.calibrated:.3g} to {factor * change.improved:.3g}{unit}"
    )


def fall(change: Change) -> str:
    """Return the relative decrease of an error with its 95 % interval."""
    low, high = change.interval
    share = 100.0 * (1.0 - change.improved / change.calibrated)
    return f"{share:.3g} % (95 %: {100.0 * (1.0 - high):.3g} to {100.0 * (1.0 - low):.3g} %)"


def ratio(change: Change) -> str:
    """Return the 95 % interval of improved over re-calibrated."""
    low, high = change.interval
    if not isfinite(high):
        return "too few pieces of time for an interval"
    return f"ratio {_formatted_ratio(low)} to {_formatted_ratio(high)}"


def _formatted_ratio(share: float) -> str:
    return f"{share:.3f}" if share >= 0.1 else f"{share:.2g}"


def log_likelihood(improvement: Improvement) -> str:
    """Return the held-out log-likelihood gain with its 95 % interval."""
    low, high = improvement.interval
    gain = f"held-out log-likelihood gain {improvement.log_likelihood_gain:.0f} nats"
    return f"{gain} (95 %: {low:.0f} to {high:.0f})" if isfinite(low) else gain


def words(name: str) -> str:
    """Return a name without underscores."""
    return name.replace("_", " ")


def _factor_and_unit(o: OutputImprovement, written: WrittenUnits) -> tuple[float, str]:
    """Return the factor from SI and the unit with a leading space; empty for a ratio."""
    factor, unit = written.factor(o.unit, words(o.output))
    return factor, "" if unit == "1" else f" {unit}"

"""The improvement in sentences: against the re-calibrated file, on held-out recordings."""

from collections.abc import Sequence
from math import isfinite

from slipbench.identification.mismatch.reporting.improvement import (
    Change,
    Improvement,
    OutputImprovement,
)
from slipbench.identification.mismatch.simulation.written_units import WrittenUnits


def improvement_in_words(found: Improvement, headline: str, written: WrittenUnits) -> str:
    """Say what falls and by how much; where no simulation error falls, say that first.

    headline: the output that was chosen on the training recordings, told first.
    """
    first = _first(found, headline)
    shown = shown_by(found, headline)
    rises = _rises([o for o in found.outputs if o.simulation.rises], written)
    if shown.simulation.falls:
        said = _falls(shown, "simulation error", shown.simulation, written)
        return f"Held out, {said}; {rises}{log_likelihood(found)}."
    stays = first.simulation
    factor, unit = _scale(first, written)
    no_fall = (
        f"Held out, no simulation error falls measurably against the re-calibrated file"
        f" ({words(first.output)}: {factor * stays.calibrated:.4g} re-calibrated,"
        f" {factor * stays.improved:.4g}{unit} improved, {ratio(stays)})"
    )
    return f"{no_fall}; {rises}{_finer(shown, written)}{log_likelihood(found)}."


def shown_by(found: Improvement, headline: str) -> OutputImprovement:
    """Return the output that shows the improvement: its simulation error falls, or a finer one."""
    first = _first(found, headline)
    for falls in (_simulation, _in_band, _one_step):
        for o in (first, *sorted(found.outputs, key=lambda o: -o.share)):
            if falls(o):
                return o
    return first


def _first(found: Improvement, headline: str) -> OutputImprovement:
    return found.of(headline) or found.differs_most


def _simulation(o: OutputImprovement) -> bool:
    return o.simulation.falls


def _in_band(o: OutputImprovement) -> bool:
    return o.in_band is not None and o.in_band.falls


def _one_step(o: OutputImprovement) -> bool:
    return o.one_step.falls


def _rises(outputs: Sequence[OutputImprovement], written: WrittenUnits) -> str:
    told = []
    for o in outputs:
        factor, unit = _scale(o, written)
        now = (
            f"{factor * o.simulation.calibrated:.3g} to {factor * o.simulation.improved:.3g}{unit}"
        )
        told.append(f"that of {words(o.output)} rises from {now} ({ratio(o.simulation)}); ")
    return "".join(told)


def _finer(o: OutputImprovement, written: WrittenUnits) -> str:
    """Say in which finer measure the effect shows, if in any."""
    if o.band and o.in_band and o.in_band.falls:
        error = f"error from {o.band[0]:.3g} to {o.band[1]:.3g} Hz"
        return f"{_falls(o, error, o.in_band, written)}; "
    if o.one_step.falls:
        return f"{_falls(o, 'one-step error', o.one_step, written)}; "
    return ""


def _falls(o: OutputImprovement, error: str, change: Change, written: WrittenUnits) -> str:
    factor, unit = _scale(o, written)
    return (
        f"the {error} of {words(o.output)} falls by {fall(change)} against the re-calibrated file,"
        f" from {factor * change.calibrated:.3g} to {factor * change.improved:.3g}{unit}"
    )


def fall(change: Change) -> str:
    """Say by how much an error falls, with its 95 % interval."""
    low, high = change.interval
    share = 100.0 * (1.0 - change.improved / change.calibrated)
    return f"{share:.3g} % (95 %: {100.0 * (1.0 - high):.3g} to {100.0 * (1.0 - low):.3g} %)"


def ratio(change: Change) -> str:
    """Say the 95 % interval of improved over re-calibrated."""
    low, high = change.interval
    if not isfinite(high):
        return "too few pieces of time for an interval"
    return f"ratio {_digits(low)} to {_digits(high)}"


def _digits(share: float) -> str:
    return f"{share:.3f}" if share >= 0.1 else f"{share:.2g}"


def log_likelihood(found: Improvement) -> str:
    """Say the held-out log-likelihood gain with its 95 % interval."""
    low, high = found.interval
    told = f"held-out log-likelihood gain {found.log_likelihood_gain:.0f} nats"
    return f"{told} (95 %: {low:.0f} to {high:.0f})" if isfinite(low) else told


def words(name: str) -> str:
    """A name without underscores."""
    return name.replace("_", " ")


def _scale(o: OutputImprovement, written: WrittenUnits) -> tuple[float, str]:
    """Factor from SI, and the unit as it stands after a number: nothing for a ratio."""
    factor, unit = written.factor(o.unit, words(o.output))
    return factor, "" if unit == "1" else f" {unit}"

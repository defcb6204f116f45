"""The verdict in sentences and lines of text."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import floor, log10, pi

from slipbench.identification.mismatch.fit.held_out import Error
from slipbench.identification.mismatch.naming.interval import Estimate
from slipbench.identification.mismatch.reporting.check_in_words import check_lines
from slipbench.identification.mismatch.reporting.improvement_in_words import (
    improvement_in_words,
    ratio,
)
from slipbench.identification.mismatch.reporting.large_errors import (
    large_errors,
    large_errors_in_words,
)
from slipbench.identification.mismatch.reporting.verdict import (
    INTERVALS,
    FarParameter,
    FoundEffect,
    Location,
    Remains,
    Verdict,
)
from slipbench.identification.mismatch.simulation.regressor import (
    OVER,
    PAST,
    SCALE,
    kind_of,
    quantity_of,
)
from slipbench.identification.mismatch.simulation.written_units import WrittenUnits

_DIRECTIONS = {"both": "opening and closing", "opening": "opening", "closing": "closing"}
SHORT = 0.1  # m; smaller values are reported in mm
SCALED = {"rad": (1e3, "mrad"), "s": (1e3, "ms"), "1": (100.0, "%"), "1/s": (100.0, "%/s")}


def sentence(verdict: Verdict) -> str:
    """Return the verdict in a few sentences."""
    large = large_errors_in_words(verdict) if verdict.complete else ""
    return f"{_finding(verdict)} {large}".rstrip()


def _finding(verdict: Verdict) -> str:
    if not verdict.mismatch:
        return _no_mismatch(verdict)
    location = verdict.location
    if verdict.unknown and not verdict.shape:
        return f"Mismatch detected, not located: {_why_not_located(verdict)}."
    if verdict.unknown:
        place = (
            f" It acts as {location.injection}{regressor_in_words(location.regressor)}"
            if location
            else ""
        )
        return (
            "Mismatch detected: no effect of the library explains it."
            f"{place}: {verdict.shape}.{_held_out_improvement(verdict)}"
        )
    if not verdict.effects:
        place = (
            f" at {location.injection}{regressor_in_words(location.regressor)}" if location else ""
        )
        return f"Mismatch detected{place}; the effect is not identified yet."
    missing = "; ".join(_effect_in_words(e, verdict) for e in verdict.effects if e.stated is None)
    existing = "; ".join(
        _effect_in_words(e, verdict) for e in verdict.effects if e.stated is not None
    )
    parts = [f"{missing} that the simulation lacks"] * bool(missing) + [existing] * bool(existing)
    return " ".join(f"{part[0].upper()}{part[1:]}." for part in parts) + _held_out_improvement(
        verdict
    )


def _why_not_located(verdict: Verdict) -> str:
    if not verdict.vetoes:
        return "no effect of the library and no free curve is sufficient"
    names = ", ".join(veto.name for veto in verdict.vetoes)
    return (
        f"the held-out recordings contradict what explains it on the training recordings ({names})"
    )


def effect_regressor_in_words(effect: FoundEffect) -> str:
    """Return the regressor of an effect in words."""
    return regressor_in_words(effect.regressor) or " (along no single quantity)"


def _no_mismatch(verdict: Verdict) -> str:
    if verdict.complete:
        if large_errors(verdict):
            return "No mismatch is significant, yet simulation and recordings do not agree."
        return (
            "Simulation and recordings agree: no significant mismatch that these recordings could"
            " show."
        )
    ended = "The analysis failed" if verdict.failure else "Interrupted"
    if verdict.p_value is None:
        return f"{ended} before any test was complete: no conclusion."
    if verdict.mismatch is None:
        return f"{ended} before all tests were complete: no significant mismatch so far."
    return f"No significant mismatch. {ended} before the report was complete."


def early_end(verdict: Verdict) -> str:
    """Return why an analysis is incomplete; empty if it is complete."""
    if verdict.failure:
        return f"The analysis failed in {verdict.failure}. These are the results so far."
    return "" if verdict.complete else "Interrupted. These are the results so far."


def chance(verdict: Verdict) -> str:
    """Return the p-value as text."""
    return "not known" if verdict.p_value is None else f"{verdict.p_value:.2g}"


def regressor_in_words(regressor: str) -> str:
    """Return a regressor in words, with a leading space; empty without a regressor."""
    kind, quantity = kind_of(regressor), quantity_of(regressor)
    if kind == SCALE:
        return f" as a share of the {scaled_by(regressor)}, along the {quantity}"
    kind = "history of " if kind == PAST else kind
    return f" along the {kind}{'the ' if kind else ''}{quantity}" if regressor else ""


def scaled_by(regressor: str) -> str:
    """Return the quantity that a scale regressor scales."""
    return regressor.removeprefix(SCALE).partition(OVER)[0]


def shown(p: Estimate, effect: FoundEffect, verdict: Verdict) -> Estimate:
    """Return a parameter in the unit of the file; in SI if the file states none."""
    quantities = [name.replace("_", " ") for name in effect.subject.split("/")]
    factor, unit = verdict.written.factor(p.unit, *quantities)
    return Estimate(p.name, unit, factor * p.value, factor * p.low, factor * p.high)


def shown_error(e: Error, verdict: Verdict) -> Error:
    """Return the errors of an output in the unit of the file; in SI if the file states none."""
    factor, unit = verdict.written.factor(e.unit, e.output.replace("_", " "))
    return replace(
        e,
        unit=unit,
        nominal=factor * e.nominal,
        calibrated=factor * e.calibrated,
        improved=factor * e.improved,
        floor=factor * e.floor,
    )


def _effect_in_words(effect: FoundEffect, verdict: Verdict) -> str:
    p = shown(effect.parameters[0], effect, verdict)
    factor, unit = SCALED.get(p.unit, (1.0, p.unit))
    if p.unit == "m" and abs(p.value) < SHORT:
        factor, unit = 1e3, "mm"
    value_text = f"{with_spread(p.value * factor, 0.5 * (p.high - p.low) * factor)} {unit}".rstrip()
    subject = (effect.subject or effect.block).replace("_", " ")
    value_text = f"{p.name.replace('_', ' ')} {value_text}"
    if effect.stated is not None:
        stated = shown(replace(effect.parameters[0], value=effect.stated), effect, verdict).value
        value_text = f"{value_text}, in the file {stated * factor:.3g} {unit}".rstrip()
    return f"the {subject} has {effect.name.replace('_', ' ')} ({value_text})"


def with_spread(value: float, spread: float) -> str:
    """Return a number and its spread, rounded to the first digit of the spread."""
    if not spread > 0.0:
        return f"{value:.3g}"
    digits = -floor(log10(spread))
    return " +- ".join(f"{round(x, digits):.{max(digits, 0)}f}" for x in (value, spread))


def _held_out_improvement(verdict: Verdict) -> str:
    if verdict.improvement is None:
        return ""
    improvement = improvement_in_words(verdict.improvement, verdict.headline, verdict.written)
    return f" {improvement}"


def lines(verdict: Verdict) -> list[str]:
    """Return the memo as lines for a terminal."""
    notes = [message] if (message := early_end(verdict)) else []
    p_value_line = f"  family-wise p-value  {chance(verdict)}"
    errors = [
        _error_line(shown_error(e, verdict), _ratio_interval(verdict, e)) for e in verdict.held_out
    ]
    checked = [f"  check          {line}" for line in check_lines(verdict)]
    details = [*_evidence(verdict), *_limits(verdict)]
    return [*notes, sentence(verdict), "", p_value_line, *details, *errors, *checked]


def _ratio_interval(verdict: Verdict, e: Error) -> str:
    """Return the interval of improved over re-calibrated; empty without an improved system."""
    improvement = verdict.improvement.of(e.output) if verdict.improvement else None
    return f"; improved/re-calibrated: {ratio(improvement.simulation)}" if improvement else ""


def _evidence(verdict: Verdict) -> Iterator[str]:
    where = verdict.location
    if where:
        yield (
            f"  where          {where.injection} ({where.block}){regressor_in_words(where.regressor)}:"
            f" {where.shape}; log-likelihood gain {where.gain:.0f} nats,"
            f" held out {where.confirmed:.0f} nats"
        )
    if where and where.band and where.region:
        yield (f"  when           {circumstances(where, verdict.written)}")
    for effect in verdict.effects:
        yield f"  {effect.name} acts{effect_regressor_in_words(effect)}"
        for p in (shown(p, effect, verdict) for p in effect.parameters):
            yield f"  {effect.name}.{p.name} = {p.value:.5g} [{p.low:.5g}, {p.high:.5g}] {p.unit}"
        yield f"    trace: {effect.trace}"
    if verdict.effects:
        yield f"  {INTERVALS}"
    for accepted_name, nats_behind in verdict.rivals.items():
        others = ", ".join(f"{n} ({lower(nats)})" for n, nats in nats_behind.items())
        if verdict.effects:
            yield f"  competing explanations of {accepted_name}: {others or 'none'}"
        else:
            yield f"  withdrawn, as a residual remains: {accepted_name}; in its place {others or 'none'}"


def lower(nats: float) -> str:
    """Return the difference of log-likelihood from the accepted name in words."""
    return (
        f"{nats:.0f} nats lower"
        if nats >= 0.0
        else f"{-nats:.0f} nats higher, but less plausible or not significant"
    )


def tied(names: Sequence[str], verdict: Verdict) -> str:
    """List indistinguishable names, each with its prior doubt."""
    doubts = (f" ({verdict.doubts[n]})" if n in verdict.doubts else "" for n in names)
    return ", ".join(f"{n}{doubt}" for n, doubt in zip(names, doubts, strict=True))


def circumstances(where: Location, written: WrittenUnits) -> str:
    """Return the band, the operating region and the direction of the mismatch in words."""
    if not where.band or not where.region:
        return ""
    low, high = where.band
    return f"{low:.3g} to {high:.3g} Hz, {_region(where, written)}, {_DIRECTIONS[where.direction]}"


def _region(where: Location, written: WrittenUnits) -> str:
    low, high = where.region or (0.0, 0.0)
    factor, unit = written.factor(where.along_unit, where.along)
    if unit == "rad/s":
        low, high = 30 / pi * low, 30 / pi * high
        return f"{where.along} {low:.0f} to {high:.0f} rpm"
    return f"{where.along} {factor * low:.4g} to {factor * high:.4g} {unit}"


def _limits(verdict: Verdict) -> Iterator[str]:
    if verdict.remains:
        yield f"  residual       {remains(verdict.remains)}"
    for veto in verdict.vetoes:
        yield f"  rejected by the held-out recordings: {veto.name} ({veto.reason})"
    for names in verdict.equivalents:
        yield f"  indistinguishable in these recordings: {tied(names, verdict)}"
    if verdict.not_excited:
        yield f"  not excited: {', '.join(verdict.not_excited)}"
    if verdict.not_told:
        yield f"  not identifiable from these recordings: {', '.join(verdict.not_told)}"
    if verdict.far:
        yield f"  far from the file: {far_in_words(verdict.far)}"
    for message in left_out(verdict):
        yield f"  left out: {message}"
    if verdict.next_trial:
        yield f"  next trial: {verdict.next_trial['why']}"


def far_in_words(far: Sequence[FarParameter]) -> str:
    """Report the parameters that calibration moved far from the file, and a possible cause."""
    changes = ", ".join(
        f"{p.key} {100 * (p.calibrated / p.stated - 1):+.0f} %"
        if p.stated
        else f"{p.key} {p.calibrated - p.stated:+.3g}"
        for p in far
    )
    return (
        f"{changes}: check these values and their plus_minus; they may make up for an effect that is"
        " not found or called not excited"
    )


def left_out(verdict: Verdict) -> Iterator[str]:
    """Yield each reason for data that was not used, with the channels and recordings concerned."""
    recordings: dict[tuple[str, str], list[str]] = {}
    for message in verdict.left_out:
        recording, _, rest = message.partition(": ")
        channel, _, reason = rest.partition(": ")
        recordings.setdefault((channel, reason), []).append(recording)
    channels: dict[tuple[str, str], list[str]] = {}
    for (channel, reason), concerned in recordings.items():
        channels.setdefault((reason, ", ".join(concerned)), []).append(channel)
    for (reason, names), absent in channels.items():
        yield f"{', '.join(absent)}{f': {reason}' if reason else ''} ({names})"


def remains(residual: Remains) -> str:
    """Report the residual of the accepted effects."""
    return (
        f"{residual.injection}{regressor_in_words(residual.regressor)}: {residual.shape};"
        f" {100 * residual.share:.2g} % of the"
        " mean square that the accepted effects explain"
    )


def _error_line(e: Error, ratio_text: str) -> str:
    return (
        f"  {e.output:<20} {e.calibrated:10.4g} -> {e.improved:10.4g} {e.unit:<6}"
        f" noise floor {e.floor:.3g} ({e.floor_from}){ratio_text}; nominal {e.nominal:.4g}"
    )

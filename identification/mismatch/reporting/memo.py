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
SHORT = 0.1  # m; what is shorter is told in mm
SCALED = {"rad": (1e3, "mrad"), "s": (1e3, "ms"), "1": (100.0, "%"), "1/s": (100.0, "%/s")}


def sentence(verdict: Verdict) -> str:
    """The verdict in a few sentences."""
    large = large_errors_in_words(verdict) if verdict.complete else ""
    return f"{_found(verdict)} {large}".rstrip()


def _found(verdict: Verdict) -> str:
    if not verdict.mismatch:
        return _no_mismatch(verdict)
    where = verdict.location
    if verdict.unknown:
        place = f" It acts as {where.injection}{along(where.regressor)}" if where else ""
        return (
            "Mismatch detected: no effect of the library explains it."
            f"{place}: {verdict.shape}.{_proof(verdict)}"
        )
    if not verdict.effects:
        place = f" at {where.injection}{along(where.regressor)}" if where else ""
        return f"Mismatch detected{place}; the effect is not identified yet."
    lacking = "; ".join(_effect(e, verdict) for e in verdict.effects if e.stated is None)
    other = "; ".join(_effect(e, verdict) for e in verdict.effects if e.stated is not None)
    told = [f"{lacking} that the simulation lacks"] * bool(lacking) + [other] * bool(other)
    return " ".join(f"{t[0].upper()}{t[1:]}." for t in told) + _proof(verdict)


def effect_along(effect: FoundEffect) -> str:
    """Say along what an effect acts."""
    return along(effect.regressor) or " (along no single quantity)"


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
    """Say why an analysis ended early; empty where it is complete."""
    if verdict.failure:
        return f"The analysis failed in {verdict.failure}. These are the results so far."
    return "" if verdict.complete else "Interrupted. These are the results so far."


def chance(verdict: Verdict) -> str:
    """Say the p-value."""
    return "not known" if verdict.p_value is None else f"{verdict.p_value:.2g}"


def along(regressor: str) -> str:
    """Say along what a curve acts, with a space before it; nothing where a name tells."""
    kind, quantity = kind_of(regressor), quantity_of(regressor)
    if kind == SCALE:
        return f" as a share of the {scaled_by(regressor)}, along the {quantity}"
    kind = "history of " if kind == PAST else kind
    return f" along the {kind}{'the ' if kind else ''}{quantity}" if regressor else ""


def scaled_by(regressor: str) -> str:
    """Return the quantity that counts for more or less."""
    return regressor.removeprefix(SCALE).partition(OVER)[0]


def shown(p: Estimate, effect: FoundEffect, verdict: Verdict) -> Estimate:
    """Parameter in the unit of the file; in SI if the file says nothing."""
    quantities = [name.replace("_", " ") for name in effect.subject.split("/")]
    factor, unit = verdict.written.factor(p.unit, *quantities)
    return Estimate(p.name, unit, factor * p.value, factor * p.low, factor * p.high)


def shown_error(e: Error, verdict: Verdict) -> Error:
    """Errors of an output in the unit of the file; in SI if the file says nothing."""
    factor, unit = verdict.written.factor(e.unit, e.output.replace("_", " "))
    return replace(
        e,
        unit=unit,
        nominal=factor * e.nominal,
        calibrated=factor * e.calibrated,
        improved=factor * e.improved,
        floor=factor * e.floor,
    )


def _effect(effect: FoundEffect, verdict: Verdict) -> str:
    p = shown(effect.parameters[0], effect, verdict)
    factor, unit = SCALED.get(p.unit, (1.0, p.unit))
    if p.unit == "m" and abs(p.value) < SHORT:
        factor, unit = 1e3, "mm"
    size = f"{with_spread(p.value * factor, 0.5 * (p.high - p.low) * factor)} {unit}".rstrip()
    where = (effect.subject or effect.block).replace("_", " ")
    size = f"{p.name.replace('_', ' ')} {size}"
    if effect.stated is not None:
        stated = shown(replace(effect.parameters[0], value=effect.stated), effect, verdict).value
        size = f"{size}, in the file {stated * factor:.3g} {unit}".rstrip()
    return f"the {where} has {effect.name.replace('_', ' ')} ({size})"


def with_spread(value: float, spread: float) -> str:
    """Tell a number as exactly as it is known, in plain digits."""
    if not spread > 0.0:
        return f"{value:.3g}"
    place = -floor(log10(spread))
    return " +- ".join(f"{round(x, place):.{max(place, 0)}f}" for x in (value, spread))


def _proof(verdict: Verdict) -> str:
    if verdict.improvement is None:
        return ""
    told = improvement_in_words(verdict.improvement, verdict.headline, verdict.written)
    return f" {told}"


def lines(verdict: Verdict) -> list[str]:
    """The memo for a terminal."""
    early = [said] if (said := early_end(verdict)) else []
    chances = f"  family-wise p-value  {chance(verdict)}"
    errors = [_error(shown_error(e, verdict), _against(verdict, e)) for e in verdict.held_out]
    checked = [f"  check          {line}" for line in check_lines(verdict)]
    found = [*_evidence(verdict), *_limits(verdict)]
    return [*early, sentence(verdict), "", chances, *found, *errors, *checked]


def _against(verdict: Verdict, e: Error) -> str:
    """Say the interval of improved over re-calibrated; empty where nothing was found."""
    found = verdict.improvement.of(e.output) if verdict.improvement else None
    return f"; improved/re-calibrated: {ratio(found.simulation)}" if found else ""


def _evidence(verdict: Verdict) -> Iterator[str]:
    where = verdict.location
    if where:
        yield (
            f"  where          {where.injection} ({where.block}){along(where.regressor)}:"
            f" {where.shape}; log-likelihood gain {where.gain:.0f} nats,"
            f" held out {where.confirmed:.0f} nats"
        )
    if where and where.band and where.region:
        yield (f"  when           {circumstances(where, verdict.written)}")
    for effect in verdict.effects:
        yield f"  {effect.name} acts{effect_along(effect)}"
        for p in (shown(p, effect, verdict) for p in effect.parameters):
            yield f"  {effect.name}.{p.name} = {p.value:.5g} [{p.low:.5g}, {p.high:.5g}] {p.unit}"
        yield f"    trace: {effect.trace}"
    if verdict.effects:
        yield f"  {INTERVALS}"
    for found, behind in verdict.rivals.items():
        others = ", ".join(f"{n} ({lower(nats)})" for n, nats in behind.items())
        yield f"  competing explanations of {found}: {others or 'none'}"


def lower(nats: float) -> str:
    """Say by how much the log-likelihood of a name is below that of the accepted one."""
    return f"{nats:.0f} nats lower" if nats >= 0.0 else f"{-nats:.0f} nats higher, less plausible"


def tied(names: Sequence[str], verdict: Verdict) -> str:
    """List names that cannot be told apart, each with what speaks against it beforehand."""
    against = (f" ({verdict.doubts[n]})" if n in verdict.doubts else "" for n in names)
    return ", ".join(f"{n}{why}" for n, why in zip(names, against, strict=True))


def circumstances(where: Location, written: WrittenUnits) -> str:
    """Say in which band and region it acts, and in which direction."""
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
    for told in left_out(verdict):
        yield f"  left out: {told}"
    if verdict.next_trial:
        yield f"  next trial: {verdict.next_trial['why']}"


def far_in_words(far: Sequence[FarParameter]) -> str:
    """Say which parameters calibration moved far, and what may follow."""
    told = ", ".join(
        f"{p.key} {100 * (p.calibrated / p.stated - 1):+.0f} %"
        if p.stated
        else f"{p.key} {p.calibrated - p.stated:+.3g}"
        for p in far
    )
    return (
        f"{told}: check these values and their plus_minus; they may make up for an effect that is"
        " not found or called not excited"
    )


def left_out(verdict: Verdict) -> Iterator[str]:
    """Say what could not be used, once for all recordings to which it applies."""
    where: dict[str, list[str]] = {}
    for told in verdict.left_out:
        name, _, why = told.partition(": ")
        where.setdefault(why, []).append(name)
    for why, names in where.items():
        yield f"{why} ({', '.join(names)})"


def remains(left: Remains) -> str:
    """Say what remains in the residual beside the accepted effects."""
    return (
        f"{left.injection}{along(left.regressor)}: {left.shape}; {100 * left.share:.2g} % of the"
        " mean square that the accepted effects explain"
    )


def _error(e: Error, against: str) -> str:
    return (
        f"  {e.output:<20} {e.calibrated:10.4g} -> {e.improved:10.4g} {e.unit:<6}"
        f" noise floor {e.floor:.3g} ({e.floor_from}){against}; nominal {e.nominal:.4g}"
    )

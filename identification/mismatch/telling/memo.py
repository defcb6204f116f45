"""The verdict as an engineer would say it."""

from collections.abc import Iterator
from math import floor, log10, pi

from slipbench.identification.mismatch.fit.held_out import Error
from slipbench.identification.mismatch.simulation.along import OVER, SCALE, kind_of, quantity_of
from slipbench.identification.mismatch.telling.verdict import (
    FoundEffect,
    Location,
    Remains,
    Verdict,
)
from slipbench.plant.effects.library import BY_NAME

_DIRECTIONS = {"both": "opening and closing", "opening": "opening", "closing": "closing"}
SCALED = {"rad": (1e3, "mrad"), "s": (1e3, "ms"), "1": (100.0, "%"), "1/s": (100.0, "%/s")}


def sentence(verdict: Verdict) -> str:
    """The verdict in a sentence or two."""
    if not verdict.mismatch:
        if not verdict.complete:
            return "Nothing was found to be missing by then."
        return (
            "Simulation and recordings agree: nothing is missing that these recordings could show."
        )
    if verdict.unknown:
        where = verdict.location
        place = f" It acts as {where.injection}{along(where.regressor)}" if where else ""
        return (
            "Something is missing in the simulation that no effect of the library explains."
            f"{place}: {verdict.shape}.{_proof(verdict)}"
        )
    if not verdict.effects:
        where = verdict.location
        place = f", as {where.injection}{along(where.regressor)}" if where else ""
        return f"Something is missing in the simulation{place}; it has no name yet."
    found = "; ".join(_effect(e) for e in verdict.effects)
    return f"{found[0].upper()}{found[1:]} that the simulation lacks.{_proof(verdict)}"


def along(regressor: str) -> str:
    """Say along what a curve acts, with a space before it; nothing where a name tells."""
    kind, quantity = kind_of(regressor), quantity_of(regressor)
    if kind == SCALE:
        return f" as a share of the {scaled_by(regressor)}, along the {quantity}"
    return f" along the {kind}{'the ' if kind else ''}{quantity}" if regressor else ""


def scaled_by(regressor: str) -> str:
    """Return the quantity that counts for more or less."""
    return regressor.removeprefix(SCALE).partition(OVER)[0]


def _effect(effect: FoundEffect) -> str:
    p = effect.parameters[0]
    factor, unit = SCALED.get(p.unit, (1.0, p.unit))
    size = f"{with_spread(p.value * factor, 0.5 * (p.high - p.low) * factor)} {unit}".rstrip()
    where = (effect.subject or effect.block).replace("_", " ")
    return f"the {where} has {effect.name.replace('_', ' ')} ({p.name.replace('_', ' ')} {size})"


def with_spread(value: float, spread: float) -> str:
    """Tell a number as exactly as it is known, in plain digits."""
    if not spread > 0.0:
        return f"{value:.3g}"
    place = -floor(log10(spread))
    return " +- ".join(f"{round(x, place):.{max(place, 0)}f}" for x in (value, spread))


def _proof(verdict: Verdict) -> str:
    best = headline_error(verdict)
    if best is None:
        return ""
    goes = "falls" if best.improved < best.nominal else "does not fall: it goes"
    return (
        f" The held-out error of {best.output.replace('_', ' ')} {goes} from {best.nominal:.2g}"
        f" ({best.calibrated:.2g} re-calibrated) to {best.improved:.2g} {best.unit},"
        f" floor {best.floor:.2g} ({best.floor_from})."
    )


def headline_error(verdict: Verdict) -> Error | None:
    """The output that was chosen on the training recordings."""
    return next((e for e in verdict.held_out if e.output == verdict.headline), None)


def lines(verdict: Verdict) -> list[str]:
    """The memo for a terminal."""
    early = [] if verdict.complete else ["Interrupted; this is what was known by then."]
    return [*early, sentence(verdict), "", *_evidence(verdict), *_limits(verdict)] + [
        _error(e) for e in verdict.held_out
    ]


def _evidence(verdict: Verdict) -> Iterator[str]:
    where = verdict.location
    if where:
        yield (
            f"  where          {where.injection} ({where.block}){along(where.regressor)}:"
            f" {where.shape}; {where.gain:.0f} nats, held out {where.confirmed:.0f}"
        )
    if where and where.band and where.region:
        yield (f"  when           {circumstances(where)}")
    for effect in verdict.effects:
        for p in effect.parameters:
            yield f"  {effect.name}.{p.name} = {p.value:.5g} [{p.low:.5g}, {p.high:.5g}] {p.unit}"
        yield f"    trace: {trace_of(effect.name)}"
    for found, behind in verdict.rivals.items():
        others = ", ".join(f"{n} ({nats:.0f} nats behind)" for n, nats in behind.items())
        yield f"  rivals of {found}: {others or 'none'}"


def circumstances(where: Location) -> str:
    """Say in which band and region it acts, and in which direction."""
    if not where.band or not where.region:
        return ""
    low, high = where.band
    return f"{low:.3g} to {high:.3g} Hz, {_region(where)}, {_DIRECTIONS[where.direction]}"


def _region(where: Location) -> str:
    low, high = where.region or (0.0, 0.0)
    if where.along_unit == "rad/s":
        low, high = 30 / pi * low, 30 / pi * high
        return f"{where.along} {low:.0f} to {high:.0f} rpm"
    return f"{where.along} {low:.4g} to {high:.4g} {where.along_unit}"


def _limits(verdict: Verdict) -> Iterator[str]:
    if verdict.remains:
        yield f"  unexplained    {remains(verdict.remains)}"
    for names in verdict.equivalents:
        yield f"  cannot be told apart here: {', '.join(names)}"
    if verdict.not_excited:
        yield f"  not excited: {', '.join(verdict.not_excited)}"
    if verdict.not_told:
        yield f"  these recordings say nothing of: {', '.join(verdict.not_told)}"
    for told in left_out(verdict):
        yield f"  left out: {told}"
    if verdict.next_trial:
        yield f"  next trial: {verdict.next_trial['why']}"


def left_out(verdict: Verdict) -> Iterator[str]:
    """Say what was of no use, once for all recordings of which it is true."""
    where: dict[str, list[str]] = {}
    for told in verdict.left_out:
        name, _, why = told.partition(": ")
        where.setdefault(why, []).append(name)
    for why, names in where.items():
        yield f"{why} ({', '.join(names)})"


def remains(left: Remains) -> str:
    """Say what stays unexplained beside names that stand."""
    return (
        f"{left.injection}{along(left.regressor)}: {left.shape}; {100 * left.share:.2g} % of what"
        " the names explain, in mean squares"
    )


def trace_of(effect: str) -> str:
    """Return the trace that the effect's page tells of."""
    return " ".join(BY_NAME[effect].page().get("Trace", "").split()) if effect in BY_NAME else ""


def _error(e: Error) -> str:
    low, high = e.interval
    return (
        f"  {e.output:<20} {e.nominal:10.4g} -> {e.calibrated:10.4g} -> {e.improved:10.4g}"
        f" {e.unit:<6} floor {e.floor:.3g} ({e.floor_from});"
        f" improved/nominal {low:.3f} to {high:.3f}"
    )

"""From an analysis to its verdict, however far it came."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from slipbench.identification.mismatch.analysis import (
    Analysis,
    accepted,
    described,
    equivalents,
    not_excited,
    unexplained,
    where_found,
)
from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.free_curve import FreeCurve
from slipbench.identification.mismatch.curves.operating_region import OperatingRegion
from slipbench.identification.mismatch.curves.words import shape_in_words
from slipbench.identification.mismatch.fit.calibrate import parameters_far_from_prior
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.floor import lack_of_fit
from slipbench.identification.mismatch.fit.sizing import sizes
from slipbench.identification.mismatch.fit.variance_inflation import FAMILY
from slipbench.identification.mismatch.naming.interval import estimates
from slipbench.identification.mismatch.naming.named import Named
from slipbench.identification.mismatch.reporting.improved import not_told
from slipbench.identification.mismatch.reporting.improvement import Improvement, improvement
from slipbench.identification.mismatch.reporting.regressor import regressor_of
from slipbench.identification.mismatch.reporting.step_note import step_note
from slipbench.identification.mismatch.reporting.verdict import (
    FarParameter,
    FoundCurve,
    FoundEffect,
    Location,
    Remains,
    Verdict,
)
from slipbench.identification.mismatch.simulation.regressor import (
    HYSTERESIS,
    PAST,
    SCALE,
    TURN,
    quantity_of,
)
from slipbench.identification.mismatch.simulation.system import System


def verdict(a: Analysis) -> Verdict:
    """Result of an analysis, however far it came.

    Where a part of it cannot be concluded, what is known without that part, and the failure.
    """
    for conclude in (_full,) * (a.named is not None) + (_early,):
        try:
            return replace(
                conclude(a),
                failure=a.failure,
                complete=a.complete and not a.failure,
                written=a.system.written,
            )
        except Exception as fault:  # what was found before must not be lost with it
            a.failure = a.failure or described("conclusion", fault)
    return Verdict(None, None, left_out=_left_out(a), complete=False, failure=a.failure)


def _early(a: Analysis) -> Verdict:
    """Result before effects were selected: no mismatch is concluded from part of the tests."""
    if not a.before:
        return Verdict(None, None, left_out=_left_out(a))
    p = _least(a.before)
    where = _location(a, where_found(a), a.when)
    return Verdict(True if p < FAMILY else None, p, where, left_out=_left_out(a))


def _full(a: Analysis) -> Verdict:
    """Result with selected effects."""
    assert a.named is not None
    doubt = unexplained(a)
    effects = () if doubt else tuple(_effects(a.named))
    along = effects[0].regressor if effects else ""
    left = (a.after if a.named.names else a.before) if doubt else a.before
    p = min(a.named.p, _least(a.before))
    return Verdict(
        mismatch=p < FAMILY,
        p_value=p,
        location=(where := _place(a, left, doubt, along)),
        suspected=None if where else _suspected(a),
        effects=effects,
        unknown=doubt,
        shape=_shape(a, where_found(a) or left[0]) if doubt and left else "",
        remains=_remains(a) if not doubt else None,
        curve=_curve(a.free),
        equivalents=tuple(equivalents(a.named)) if not doubt else (),
        rivals=a.named.competing,
        doubts={} if doubt else _doubts(a.named),
        not_excited=tuple(not_excited(a.named)),
        not_told=tuple(not_told(a.named.fit)),
        far=_far(a.named.fit if effects else a.named.base),
        next_trial=_proposed(a),
        improvement=_improvement(a),
        vetoes=tuple(a.vetoes),
        held_out=tuple(a.errors),
        headline=a.headline,
        lack_of_fit=tuple(f for f in (lack_of_fit(a.base), lack_of_fit(a.named.fit)) if f)
        if a.base
        else (),
        left_out=_left_out(a),
    )


def _doubts(named: Named) -> dict[str, str]:
    """Say what speaks beforehand against names that cannot be told apart."""
    tied = {name for names in equivalents(named) for name in names}
    return {name: why for name, why in named.doubts.items() if name in tied}


def _improvement(a: Analysis) -> Improvement | None:
    """Compare, on held-out recordings, the re-calibrated system and the one that stands."""
    if not a.proof or a.base is None or accepted(a) is a.base:
        return None
    return improvement(*a.proof[1:])


def _left_out(a: Analysis) -> tuple[str, ...]:
    records = (*a.training.records, *(a.held_out.records if a.held_out else ()))
    told = [f"{r.name}: {w}" for r in records for w in (*r.left_out, *r.notes)]
    note = step_note(accepted(a)) if a.base is not None and a.named is not None else ""
    return (*told, *([note] if note else []))


def _proposed(a: Analysis) -> Mapping[str, Any] | None:
    if a.proposal is None:
        return None
    why, choice = a.proposal
    return {"why": why, "trial": dict(a.system.trial(choice, "next_trial", "vehicle.toml"))}


def _least(curves: Sequence[Curve]) -> float:
    return min((c.p for c in curves), default=1.0)


def _location(a: Analysis, c: Curve | None, when: OperatingRegion | None = None) -> Location | None:
    if c is None:
        return None
    where = Location(
        c.block, c.place, c.regressor, _shape(a, c), c.log_likelihood_gain, c.confirmed
    )
    if when is None:
        return where
    return replace(
        where,
        band=when.band,
        region=when.region,
        direction=when.direction,
        along=when.along,
        along_unit=when.along_unit,
    )


def _shape(a: Analysis, curve: Curve) -> str:
    read, unit = in_written_units(curve, a.system)
    return shape_in_words(read, unit)


def in_written_units(curve: Curve, system: System) -> tuple[Curve, str]:
    """Curve in the units of the system's file, and the unit of its quantity."""
    quantity = quantity_of(curve.regressor)
    x, unit = system.written.factor(system.units.get(quantity, ""), quantity)
    y, of_values = system.written.factor(curve.unit, curve.place)
    if curve.kind == PAST:
        return replace(curve, values=y / x * curve.values, unit=of_values), unit
    if curve.kind == HYSTERESIS:
        scaled = replace(curve, knots=x * curve.knots, values=y / x * curve.values)
        return replace(scaled, unit=of_values), unit
    if curve.kind == SCALE:
        return replace(curve, knots=x * curve.knots), unit
    if curve.kind == TURN:
        return replace(curve, values=y * curve.values, unit=of_values), "rad"
    return replace(curve, knots=x * curve.knots, values=y * curve.values, unit=of_values), unit


def _place(a: Analysis, left: Sequence[Curve], doubt: bool, along: str) -> Location | None:
    """Where it acts: as the names that stand tell, or as the free curves alone do.

    What a free curve imitates best may sit at the next seam; a name that explains all knows.
    along: the regressor of the first of these names.
    """
    assert a.named is not None
    seen = _location(a, where_found(a), a.when)
    told = None if doubt else _of_the_named(a.system, a.named, along)
    if told is None:
        first = left[0] if doubt and left and left[0].certain else None
        return seen or _location(a, first)
    if seen is None:
        return told
    if seen.injection == told.injection and seen.regressor == (along or seen.regressor):
        return seen
    shape = (
        f"{told.shape}; localized without the library at {seen.injection} along {seen.regressor}"
    )
    return replace(
        seen,
        block=told.block,
        injection=told.injection,
        regressor=along,
        shape=shape,
        gain=told.gain,
        confirmed=seen.confirmed,
    )


def _suspected(a: Analysis) -> Location | None:
    """Where the best free curve acts that is not significant, if a held-out error is large."""
    if not a.before or not any(e.large for e in a.errors):
        return None
    best = min(a.before, key=lambda c: c.p)
    where = _location(a, best) if best.p < 1.0 else None
    return replace(where, p_value=best.p) if where else None


def _of_the_named(system: System, named: Named, along: str) -> Location | None:
    """Where the first named effect acts; None where nothing is named, or its place is unknown."""
    if not named.fit.effects:
        return None
    first = named.fit.effects[0]
    place = system.acts_at(first.pattern)
    if not place:
        return None
    return Location(
        first.kind.block,
        place,
        along,
        "as described by its equation",
        named.log_likelihood_gain,
        0.0,
    )


def _remains(a: Analysis) -> Remains | None:
    if a.remains is None:
        return None
    c = a.remains.curve
    return Remains(c.place, c.regressor, _shape(a, c), a.remains.share)


def _curve(free: FreeCurve | None) -> FoundCurve | None:
    if free is None:
        return None
    c = free.curve
    knots, values = (tuple(map(float, x)) for x in (c.knots, c.values))
    return FoundCurve(
        c.place, c.unit, c.regressor, knots, values, free.log_likelihood_gain, free.confirmed
    )


def _far(fit: Fit) -> tuple[FarParameter, ...]:
    """Parameters that went far from the file, the farthest first.

    Of the re-calibrated file where no names stand: a free curve may stand for a wrong number.
    """
    found = sorted(parameters_far_from_prior(fit), key=lambda each: -abs(each[1]))
    return tuple(FarParameter(k.key, k.value, k.at(x), x) for k, x in found)


def _stated(found: Candidate, system: System) -> float | None:
    own = next((e for e in system.effects if e.key == found.name), None)
    return None if own is None else float(getattr(own, sizes(found.kind)[0].name))


def _effects(named: Named) -> list[FoundEffect]:
    return [
        FoundEffect(
            c.kind.name,
            c.pattern.subject,
            c.kind.block,
            tuple(estimates(named.fit, i)),
            named.log_likelihood_gain,
            " ".join(c.kind.page().get("Trace", "").split()),
            regressor_of(named.fit, i),
            _stated(c, named.fit.model.system),
        )
        for i, c in enumerate(named.fit.effects)
    ]

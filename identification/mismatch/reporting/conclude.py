"""Conclude the verdict of an analysis, also of an incomplete one."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from slipbench.identification.mismatch.analysis import (
    Analysis,
    accepted,
    equivalents,
    failure_message,
    localizing_curve,
    not_excited,
    unexplained,
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
from slipbench.identification.mismatch.thresholds import FALSE_ALARM_RATE


def verdict(a: Analysis) -> Verdict:
    """Return the verdict of an analysis, also of an incomplete one.

    If the conclusion fails, return the verdict without the named effects, and the failure.
    """
    for conclude in (_complete_verdict,) * (a.named is not None) + (_partial_verdict,):
        try:
            return replace(
                conclude(a),
                failure=a.failure,
                complete=a.complete and not a.failure,
                written=a.system.written,
            )
        except Exception as error:  # keep the earlier results
            a.failure = a.failure or failure_message("conclusion", error)
    return Verdict(None, None, left_out=_left_out(a), complete=False, failure=a.failure)


def _partial_verdict(a: Analysis) -> Verdict:
    """Return the verdict before effects are selected: mismatch is detected or undecided."""
    if not a.before:
        return Verdict(None, None, left_out=_left_out(a))
    p_value = _smallest_p(a.before)
    location = _location(a, localizing_curve(a), a.operating_region)
    return Verdict(
        True if p_value < FALSE_ALARM_RATE else None, p_value, location, left_out=_left_out(a)
    )


def _complete_verdict(a: Analysis) -> Verdict:
    """Return the verdict with the selected effects."""
    assert a.named is not None
    unknown = unexplained(a)
    effects = () if unknown else tuple(_effects(a.named))
    regressor = effects[0].regressor if effects else ""
    curves = (a.after if a.named.names else a.before) if unknown else a.before
    p = min(a.named.p, _smallest_p(a.before))
    return Verdict(
        mismatch=p < FALSE_ALARM_RATE,
        p_value=p,
        location=(location := _conclude_location(a, curves, unknown, regressor)),
        suspected=None if location else _suspected(a),
        effects=effects,
        unknown=unknown,
        shape=_shape_of_residual(a, curves) if unknown else "",
        remains=_remains(a) if not unknown else None,
        curve=_curve(a.free),
        equivalents=tuple(equivalents(a.named)) if not unknown else (),
        rivals=a.named.rivals,
        doubts={} if unknown else _doubts(a.named),
        not_excited=tuple(not_excited(a.named)),
        not_told=tuple(not_told(a.named.fit)),
        far=_far_parameters(a.named.fit if effects else a.named.base),
        next_trial=_next_trial(a),
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
    """Return the prior doubts about names that are indistinguishable."""
    equivalent = {name for names in equivalents(named) for name in names}
    return {name: doubt for name, doubt in named.doubts.items() if name in equivalent}


def _improvement(a: Analysis) -> Improvement | None:
    """Compare the re-calibrated and the accepted system on the held-out recordings."""
    if not a.held_out_runs or a.base is None or accepted(a) is a.base:
        return None
    return improvement(*a.held_out_runs[1:])


def _left_out(a: Analysis) -> tuple[str, ...]:
    records = (*a.training.records, *(a.held_out.records if a.held_out else ()))
    messages = [f"{r.name}: {reason}" for r in records for reason in (*r.left_out, *r.notes)]
    note = step_note(accepted(a)) if a.base is not None and a.named is not None else ""
    return (*messages, *([note] if note else []))


def _next_trial(a: Analysis) -> Mapping[str, Any] | None:
    if a.proposal is None:
        return None
    reason, trial = a.proposal
    return {"why": reason, "trial": dict(a.system.trial(trial, "next_trial", "vehicle.toml"))}


def _smallest_p(curves: Sequence[Curve]) -> float:
    return min((c.p for c in curves), default=1.0)


def _location(
    a: Analysis, curve: Curve | None, when: OperatingRegion | None = None
) -> Location | None:
    if curve is None:
        return None
    location = Location(
        curve.block,
        curve.place,
        curve.regressor,
        _shape(a, curve),
        curve.log_likelihood_gain,
        curve.confirmed,
    )
    if when is None:
        return location
    return replace(
        location,
        band=when.band,
        region=when.region,
        direction=when.direction,
        along=when.along,
        along_unit=when.along_unit,
    )


def _shape(a: Analysis, curve: Curve) -> str:
    read, unit = in_written_units(curve, a.system)
    return shape_in_words(read, unit)


def _shape_of_residual(a: Analysis, curves: Sequence[Curve]) -> str:
    """Return the shape of the localizing curve, or else of the first if it is significant, in words.

    Empty if neither exists: the mismatch is not located.
    """
    first = curves[0] if curves and curves[0].significant else None
    curve = localizing_curve(a) or first or (a.remains.curve if a.remains else None)
    return _shape(a, curve) if curve else ""


def in_written_units(curve: Curve, system: System) -> tuple[Curve, str]:
    """Return a curve in the units of the system's file, and the unit of its regressor."""
    quantity = quantity_of(curve.regressor)
    x, unit = system.written.factor(system.units.get(quantity, ""), quantity)
    y, value_unit = system.written.factor(curve.unit, curve.place)
    if curve.kind == PAST:
        return replace(curve, values=y / x * curve.values, unit=value_unit), unit
    if curve.kind == HYSTERESIS:
        scaled = replace(curve, knots=x * curve.knots, values=y / x * curve.values)
        return replace(scaled, unit=value_unit), unit
    if curve.kind == SCALE:
        return replace(curve, knots=x * curve.knots), unit
    if curve.kind == TURN:
        return replace(curve, values=y * curve.values, unit=value_unit), "rad"
    return replace(curve, knots=x * curve.knots, values=y * curve.values, unit=value_unit), unit


def _conclude_location(
    a: Analysis, curves: Sequence[Curve], unknown: bool, regressor: str
) -> Location | None:
    """Return where the mismatch acts: by the accepted effects, or else by the free curves.

    The accepted effects have priority, since the best free curve may act at an adjacent place.
    regressor: of the first accepted effect.
    """
    assert a.named is not None
    localized = _location(a, localizing_curve(a), a.operating_region)
    of_effects = None if unknown else _location_of_effects(a.system, a.named, regressor)
    if of_effects is None:
        significant = curves[0] if unknown and curves and curves[0].significant else None
        return localized or _location(a, significant)
    if localized is None:
        return of_effects
    if localized.injection == of_effects.injection and localized.regressor == (
        regressor or localized.regressor
    ):
        return localized
    shape = (
        f"{of_effects.shape}; localized without the library at {localized.injection}"
        f" along {localized.regressor}"
    )
    return replace(
        localized,
        block=of_effects.block,
        injection=of_effects.injection,
        regressor=regressor,
        shape=shape,
        gain=of_effects.gain,
        confirmed=localized.confirmed,
    )


def _suspected(a: Analysis) -> Location | None:
    """Return the location of the best free curve, not significant, if a held-out error is large."""
    if not a.before or not any(e.large for e in a.errors):
        return None
    best = min(a.before, key=lambda c: c.p)
    where = _location(a, best) if best.p < 1.0 else None
    return replace(where, p_value=best.p) if where else None


def _location_of_effects(system: System, named: Named, regressor: str) -> Location | None:
    """Return the location of the first named effect; None without one or if it is unknown."""
    if not named.fit.effects:
        return None
    effect = named.fit.effects[0]
    injection = system.acts_at(effect.pattern)
    if not injection:
        return None
    return Location(
        effect.kind.block,
        injection,
        regressor,
        "as described by its equation",
        named.log_likelihood_gain,
        0.0,
    )


def _remains(a: Analysis) -> Remains | None:
    if a.remains is None:
        return None
    curve = a.remains.curve
    return Remains(curve.place, curve.regressor, _shape(a, curve), a.remains.share)


def _curve(free: FreeCurve | None) -> FoundCurve | None:
    if free is None:
        return None
    curve = free.curve
    knots, values = (tuple(map(float, x)) for x in (curve.knots, curve.values))
    return FoundCurve(
        curve.place,
        curve.unit,
        curve.regressor,
        knots,
        values,
        free.log_likelihood_gain,
        free.confirmed,
    )


def _far_parameters(fit: Fit) -> tuple[FarParameter, ...]:
    """Return the parameters that are far from their prior means, the farthest first.

    fit: re-calibrated where no effects are accepted, since a free curve may replace a parameter.
    """
    far = sorted(parameters_far_from_prior(fit), key=lambda each: -abs(each[1]))
    return tuple(
        FarParameter(coordinate.key, coordinate.value, coordinate.at(x), x) for coordinate, x in far
    )


def _stated_value(candidate: Candidate, system: System) -> float | None:
    stated_effect = next((e for e in system.effects if e.key == candidate.name), None)
    return (
        None
        if stated_effect is None
        else float(getattr(stated_effect, sizes(candidate.kind)[0].name))
    )


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
            _stated_value(c, named.fit.model.system),
        )
        for i, c in enumerate(named.fit.effects)
    ]

"""From a system's file and recordings to a verdict: the steps, one after the other."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from identification.mismatch.calibrate import calibrate
from identification.mismatch.circumstance import Circumstance, circumstance, plainest
from identification.mismatch.exchange import exchanged
from identification.mismatch.fitting import Fit
from identification.mismatch.floor import lack_of_fit
from identification.mismatch.free_curve import FreeCurve, inside
from identification.mismatch.held_out import CONFIRMED, Error, carried_over, errors, proof
from identification.mismatch.improved import not_told
from identification.mismatch.interval import estimates
from identification.mismatch.locate import Curve, effect_of, locate
from identification.mismatch.model import Model, models, predict
from identification.mismatch.naming import ALIKE, Named, Say, name
from identification.mismatch.next_trial import next_trial
from identification.mismatch.record import Record
from identification.mismatch.scatter import FAMILY
from identification.mismatch.score import SHOWN, Judge
from identification.mismatch.sensitivity import change
from identification.mismatch.sufficiency import Remainder, remainder
from identification.mismatch.system import System
from identification.mismatch.verdict import FoundCurve, FoundEffect, Location, Remains, Verdict
from identification.mismatch.words import shape_in_words
from plant.effects.effect import Effect

LEFT = 0.05  # share of what was found that a free curve may still find without being named


@dataclass(eq=False)
class Analysis:
    """Everything that is known so far; filled step by step, so that a stop loses nothing.

    kept: whether names stand though a free curve finds more beside them, since none does as well
    in their place.
    """

    system: System
    training: Model
    held_out: Model | None
    base: Fit | None = None
    before: list[Curve] = field(default_factory=list)
    when: Circumstance | None = None
    named: Named | None = None
    headline: str = ""
    after: list[Curve] = field(default_factory=list)
    remains: Remainder | None = None
    proof: list[Fit] = field(default_factory=list)
    errors: list[Error] = field(default_factory=list)
    free: FreeCurve | None = None
    kept: bool = False
    proposal: tuple[str, Any] | None = None
    done: int = 0
    complete: bool = False


def begin(system: System, training: Sequence[Record], held_out: Sequence[Record]) -> Analysis:
    """Put the recordings beside the system."""
    learnt, proof = models(system, training, held_out)
    return Analysis(system, learnt, proof if held_out else None)


def known_so_far(so_far: Analysis, say: Say = lambda _: None) -> bool:
    """Do all steps until somebody interrupts; return whether all were done."""
    try:
        analyse(so_far, say=say)
    except KeyboardInterrupt:
        return False
    return True


def analyse(
    so_far: Analysis, library: Sequence[type[Effect]] | None = None, say: Say = lambda _: None
) -> Analysis:
    """Do all steps. library: effects to look for, the system's own if not given."""
    library = so_far.system.library if library is None else library
    for number, step in enumerate(STEPS, start=1):
        if number > so_far.done:
            step(so_far, library, say)
            so_far.done = number
    so_far.complete = True
    return so_far


def _calibrate(a: Analysis, _: Sequence[type[Effect]], say: Say) -> None:
    say("re-calibrating what the file knows")
    a.base = calibrate(a.training, a.training.origin())


def _locate(a: Analysis, _: Sequence[type[Effect]], say: Say) -> None:
    assert a.base is not None
    say("locating, without the library")
    a.before = _curves(a, a.base)
    if a.before and a.before[0].certain:
        a.when = circumstance(Judge.of(a.base), a.before[0])


def _name(a: Analysis, library: Sequence[type[Effect]], say: Say) -> None:
    assert a.base is not None
    say(f"scoring {len(library)} effects")
    a.named = name(a.base, library, say, a.held_out)
    a.headline = _headline(a)


def _headline(a: Analysis) -> str:
    """Return the output that the first sentence tells of, chosen on the training recordings."""
    assert a.base is not None
    assert a.named is not None
    if a.named.names:
        fit = a.named.fit
        bare = replace(fit.point, effects=())
        trace = change(fit.model, bare, fit.point.effects, predict(fit.model, bare))
        return plainest(fit, trace)
    if a.before and a.before[0].certain:
        return plainest(a.base, effect_of(Judge.of(a.base), a.before[0]))
    return a.base.model.chain.blocks[-1].outputs[0]


def _doubt(a: Analysis, library: Sequence[type[Effect]], say: Say) -> None:
    assert a.named is not None
    if not a.named.fit.candidates:
        return
    _look_after(a, say)
    if a.system.by_factors and len(a.named.names) > 1 and unexplained(a):
        better = exchanged(a.named, library, a.held_out, say)
        if better is not a.named:
            a.named = better
            _look_after(a, say)


def _look_after(a: Analysis, say: Say) -> None:
    assert a.named is not None
    say("looking for what the named effects leave")
    a.after = _curves(a, a.named.fit)
    if a.system.by_factors:
        a.remains = remainder(a.named.base, a.named.fit, a.after)


def _free(a: Analysis, _: Sequence[type[Effect]], say: Say) -> None:
    """Withdraw the names where they do not suffice, and fit the free curve instead."""
    assert a.base is not None
    while unexplained(a) and a.before and a.free is None:
        say("fitting a free curve inside the simulation")
        found = inside(a.base, a.before, a.held_out)
        if found is None:
            return
        if a.held_out is None or found.confirmed >= CONFIRMED:
            a.kept = a.system.by_factors and _foretell_more(a, found)
            a.free = None if a.kept else found
        elif any(c.certain and c.place == found.curve.place for c in a.before):
            say("it gains nothing on the held-out recordings, and is withdrawn")
            _withdraw(a, found.curve.place)
        else:
            return


def _foretell_more(a: Analysis, found: FreeCurve) -> bool:
    """Tell whether names foretell held-out recordings better than the curve in their place.

    What is withdrawn must leave a better explanation behind, not a worse one.
    """
    assert a.base is not None
    assert a.named is not None
    if not a.named.names or a.held_out is None:
        return False
    there = carried_over(a.named.fit, a.held_out).score
    return there - carried_over(a.base, a.held_out).score > found.confirmed


def _withdraw(a: Analysis, place: str) -> None:
    """Let no free curve at a place count: fitted inside the simulation, the best one failed."""
    a.before = [replace(c, p=1.0) if c.place == place else c for c in a.before]
    a.before.sort(key=lambda c: not c.certain)
    a.when = None


def _prove(a: Analysis, _: Sequence[type[Effect]], say: Say) -> None:
    assert a.base is not None
    assert a.named is not None
    if a.held_out is not None:
        say("proving on the held-out recordings")
        a.proof = proof(a.held_out, a.base, accepted(a), a.free.proven if a.free else None)
        a.errors = errors(a.proof)


def accepted(a: Analysis) -> Fit:
    """Return the fit that stands: with names, with the free curve in their place, or bare."""
    assert a.base is not None
    assert a.named is not None
    if not unexplained(a):
        return a.named.fit
    return a.free.fit if a.free else a.base


def _propose(a: Analysis, library: Sequence[type[Effect]], say: Say) -> None:
    assert a.named is not None
    say("choosing the next trial")
    by_name = {kind.name: kind for kind in library}
    told = [n.split(".")[0] for names in _equivalents(a.named) for n in names]
    alike = [by_name[n] for n in told if n in by_name]
    hidden = [by_name[n.split(".")[0]] for n in not_excited(a.named)]
    a.proposal = next_trial(a.named.fit, alike, hidden)


STEPS = (_calibrate, _locate, _name, _doubt, _free, _prove, _propose)


def not_excited(named: Named) -> list[str]:
    """Effects that these recordings would not have shown at their typical size."""
    known = set(named.names)
    return [
        s.candidate.name
        for s in named.scores
        if s.typical < SHOWN and s.candidate.name not in known
    ]


def _curves(a: Analysis, fit: Fit) -> list[Curve]:
    others = Judge.of(carried_over(fit, a.held_out)) if a.held_out is not None else None
    return locate(Judge.of(fit), others)


def verdict(a: Analysis) -> Verdict:
    """Say what is known so far."""
    if a.named is None:
        p = _least(a.before)
        where = _location(a.before, a.when)
        return Verdict(p < FAMILY, p, where, left_out=_left_out(a), complete=False)
    doubt = unexplained(a)
    effects = () if doubt else tuple(_effects(a.named))
    left = (a.after if a.named.names else a.before) if doubt else a.before
    p = min(a.named.p, _least(a.before))
    return Verdict(
        mismatch=p < FAMILY,
        p_value=p,
        location=_place(a, left, doubt),
        effects=effects,
        unknown=doubt,
        shape=shape_in_words(left[0]) if doubt and left else "",
        remains=_remains(a) if not doubt else None,
        curve=_curve(a.free),
        equivalents=tuple(_equivalents(a.named)) if not doubt else (),
        rivals=a.named.rivals,
        not_excited=tuple(not_excited(a.named)),
        not_told=tuple(not_told(a.named.fit)),
        next_trial=_proposed(a),
        held_out=tuple(a.errors),
        headline=a.headline,
        lack_of_fit=tuple(f for f in (lack_of_fit(a.base), lack_of_fit(a.named.fit)) if f)
        if a.base
        else (),
        left_out=_left_out(a),
        complete=a.complete,
    )


def unexplained(a: Analysis) -> bool:
    """Whether a free curve still finds what the accepted effects (or none) do not explain."""
    assert a.named is not None
    if not a.named.names:
        return _certain(a.before)
    if a.kept:
        return False
    if a.system.by_factors:
        return a.remains is not None and not a.remains.small
    best = max((c.gain for c in a.after if c.certain), default=0.0)
    return best > LEFT * a.named.gain or (best > 0.0 and best > 60.0)


def _left_out(a: Analysis) -> tuple[str, ...]:
    others = a.held_out.records if a.held_out else ()
    return tuple(
        f"{r.name}: {w}" for r in (*a.training.records, *others) for w in (*r.left_out, *r.notes)
    )


def _proposed(a: Analysis) -> Mapping[str, Any] | None:
    if a.proposal is None:
        return None
    why, choice = a.proposal
    return {"why": why, "trial": dict(a.system.trial(choice, "next_trial", "vehicle.toml"))}


def _least(curves: Sequence[Curve]) -> float:
    return min((c.p for c in curves), default=1.0)


def _certain(curves: Sequence[Curve]) -> bool:
    return any(c.certain for c in curves)


def _location(curves: Sequence[Curve], when: Circumstance | None = None) -> Location | None:
    if not curves or not curves[0].certain:
        return None
    c = curves[0]
    where = Location(c.block, c.place, c.regressor, shape_in_words(c), c.gain, c.confirmed)
    if when is None:
        return where
    return replace(
        where, band=when.band, region=when.region, direction=when.direction,
        along=when.along, along_unit=when.along_unit,
    )  # fmt: skip


def _place(a: Analysis, left: Sequence[Curve], doubt: bool) -> Location | None:
    """Where it acts: as the names that stand tell, or as the free curves alone do.

    What a free curve imitates best may sit at the next seam; a name that explains all knows.
    """
    assert a.named is not None
    seen = _location(a.before, a.when)
    told = None if doubt else _of_the_named(a.system, a.named)
    if told is None:
        return seen or (_location(left) if doubt else None)
    if seen is None:
        return told
    if seen.injection == told.injection:
        return seen
    shape = f"{told.shape}; without the library like {seen.injection} along {seen.regressor}"
    return replace(
        seen, block=told.block, injection=told.injection, regressor="", shape=shape,
        gain=told.gain, confirmed=seen.confirmed,
    )  # fmt: skip


def _of_the_named(system: System, named: Named) -> Location | None:
    """Where the first named effect acts; None where nothing is named, or its place is unknown."""
    if not named.fit.effects:
        return None
    first = named.fit.effects[0]
    place = system.acts_at(first.pattern)
    if not place:
        return None
    return Location(first.kind.block, place, "", "as its name tells", named.gain, 0.0)


def _remains(a: Analysis) -> Remains | None:
    if a.remains is None:
        return None
    c = a.remains.curve
    return Remains(c.place, c.regressor, shape_in_words(c), a.remains.share)


def _curve(free: FreeCurve | None) -> FoundCurve | None:
    if free is None:
        return None
    c = free.curve
    knots, values = (tuple(map(float, x)) for x in (c.knots, c.values))
    return FoundCurve(c.place, c.unit, c.regressor, knots, values, free.gain, free.confirmed)


def _effects(named: Named) -> list[FoundEffect]:
    return [
        FoundEffect(
            c.kind.name, c.pattern.subject, c.kind.block, tuple(estimates(named.fit, i)), named.gain
        )
        for i, c in enumerate(named.fit.effects)
    ]


def _equivalents(named: Named) -> list[tuple[str, ...]]:
    return [
        (found, *others)
        for found, behind in named.rivals.items()
        if (others := [other for other, nats in behind.items() if nats < ALIKE])
    ]

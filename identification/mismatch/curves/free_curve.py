"""None of the above: a located curve is put into the simulation itself and fitted there.

Where the simulation knows a free curve at the place along the quantity, the curve is evaluated on
its own motion, so that what the curve does acts back on what drives it, and its values are fitted
jointly with everything that is uncertain. Knots move to where it bends. Elsewhere the curve acts
as an input, evaluated along its recorded regressor. Then it meets the held-out recordings.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.mismatch.curves.curve import Curve
from identification.mismatch.curves.injection import places
from identification.mismatch.curves.locate import locate
from identification.mismatch.curves.pushed import LOOSE, Pushed
from identification.mismatch.curves.tooth_curve import ANGLE
from identification.mismatch.curves.trace import regressors
from identification.mismatch.fit.calibrate import refreshed
from identification.mismatch.fit.candidate import Dialled
from identification.mismatch.fit.fitting import Fit, settle, with_effects
from identification.mismatch.fit.held_out import CONFIRMED, carried_over
from identification.mismatch.fit.judge import Judge
from identification.mismatch.simulation.along import finer
from identification.mismatch.simulation.model import Model, predict
from identification.mismatch.simulation.place import Injection
from identification.mismatch.simulation.push import Push
from identification.mismatch.simulation.system import System
from plant.effects.effect import Effect
from plant.effects.free_curve import KNOTS
from plant.signals import Floats
from plant.trouble import PlantError

ROUNDS = 6
PASSES = 3
"""How often a pushed curve's quantity is taken anew until it is that of its own simulation."""
SHARES = (1.0, 0.6, 0.3)
"""Of the way to what a fit asks for; a curve that changes its own quantity goes not all of it."""
TRIED = 2
"""Located curves that are tried inside the simulation."""
AROUND = 5
"""Places at which a push along the wheel's angle is tried."""
BENDS = 2
"""How often knots move to where the curve bends."""
NUDGE = 0.02
MOST = 3
"""Curves that may stand in together."""
FURTHER = 0.1
"""Share of what the first brings on the held-out recordings that another must bring there."""


@dataclass(frozen=True, eq=False)
class FreeCurve:
    """Curves inside the simulation. gain, confirmed: nats on training and held-out runs.

    curve: the first, as it was by itself; beside: those that take up what it leaves. proven: the
    held-out model with which `fit` meets the held-out recordings.
    """

    curve: Curve
    fit: Fit
    gain: float
    confirmed: float
    proven: Model | None
    beside: tuple[Curve, ...] = ()

    def with_another(self, other: "FreeCurve") -> "FreeCurve":
        """Return both, the other fitted beside this one."""
        return FreeCurve(
            self.curve, other.fit, self.gain + other.gain, self.confirmed + other.confirmed,
            other.proven, (*self.beside, other.curve),
        )  # fmt: skip


@dataclass(frozen=True)
class Bent(Dialled):
    """A curve with its values as dials, in pushes worth trying at its place. number: of several."""

    system: System
    place: Injection
    curve: Curve
    dials: tuple[float, ...]
    number: int

    @property
    def name(self) -> str:
        """Where it acts and along what."""
        return f"{self.place.name} along {self.curve.regressor}"

    @property
    def deviations(self) -> tuple[float, ...]:
        """Loose."""
        return (LOOSE,) * len(self.dials)

    @property
    def nudges(self) -> tuple[float, ...]:
        """Small beside a push worth trying."""
        return (NUDGE,) * len(self.dials)

    def effect(self) -> Effect:
        """Return the effect of the simulation."""
        values = self.place.size * np.array(self.dials)
        found = self.system.curve(
            self.place, self.curve.regressor, self.curve.knots, values, self.number
        )
        assert found is not None
        return found

    def moved(self, step: Floats) -> "Bent":
        """Return it with other values."""
        return replace(self, dials=tuple(float(d) for d in np.array(self.dials) + step))

    def told(self) -> Curve:
        """Return the curve with its values."""
        return replace(self.curve, values=self.place.size * np.array(self.dials))


def inside(base: Fit, curves: Sequence[Curve], held_out: Model | None) -> FreeCurve | None:
    """Put the best of the located curves into the simulation, and others beside it that help.

    None where all are of sensors.
    """
    found = _one(base, curves, held_out)
    while found is not None and held_out is not None and len(found.beside) + 1 < MOST:
        there = found.proven
        assert there is not None
        left = locate(Judge.of(found.fit), Judge.of(carried_over(found.fit, there)))
        other = _one(found.fit, [c for c in left if c.certain], there)
        if other is None or other.confirmed < max(CONFIRMED, FURTHER * found.confirmed):
            break
        found = found.with_another(other)
    return found


def _one(base: Fit, curves: Sequence[Curve], held_out: Model | None) -> FreeCurve | None:
    """Fit the best of the located curves beside those that are there already."""
    rough = base.coarse()
    tried = [fit for curve in _chosen(base, curves) for fit in _tried(rough, curve)]
    if not tried:
        return None
    best = max(tried, key=lambda t: t.score)
    if isinstance(best.candidates[-1], Pushed):
        return _standing(base, best, held_out)
    for _ in range(BENDS):
        again = _simulated(rough, _rebent(_newest(best).told()))
        if again is None or again.score < best.score:
            break
        best = again
    best = settle(refreshed(best.fine(base.model)), noises=2, steps=3)
    confirmed = 0.0
    if held_out is not None:
        confirmed = carried_over(best, held_out).score - carried_over(base, held_out).score
    return FreeCurve(_newest(best).told(), best, best.score - base.score, confirmed, held_out)


def _chosen(base: Fit, curves: Sequence[Curve]) -> list[Curve]:
    """Return the first curves, and at the first's place the first of each further kind.

    What repeats with a wheel's angle is first sought at its teeth, and may as well push the wheel.
    """
    there = [c for c in curves if _place(base, c) is not None]
    if curves and curves[0].certain and curves[0].regressor == ANGLE:
        turning = [c for c in there if c.regressor == ANGLE]
        if turning:
            return turning[:AROUND]
    certain = [c for c in there if c.certain]
    if not certain:
        return there[:1]
    same = [c for c in certain if c.place == certain[0].place]
    first_of_kind = {c.kind: c for c in reversed(same)}
    return list({id(c): c for c in (*certain[:TRIED], *first_of_kind.values())}.values())


def _tried(rough: Fit, curve: Curve) -> Iterator[Fit]:
    if _simulable(rough, curve):
        many = _many(curve.knots)
        fit = _simulated(rough, replace(curve, knots=many, values=curve(many)))
    else:
        fit = _pushed(rough, curve)
    if fit is not None:
        yield fit


def _newest(fit: Fit) -> Bent:
    bent = fit.candidates[-1]
    assert isinstance(bent, Bent)
    return bent


def _place(base: Fit, curve: Curve) -> Injection | None:
    return next((p for p in places(base) if p.name == curve.place), None)


def _simulable(base: Fit, curve: Curve) -> bool:
    """Tell whether the simulation knows a curve at this place along this quantity."""
    place, knots = _place(base, curve), np.arange(float(KNOTS))
    system = base.model.system
    return place is not None and system.curve(place, curve.regressor, knots, knots, 0) is not None


def _simulated(base: Fit, curve: Curve) -> Fit | None:
    """Fit a curve in the simulation; None where it does not know such a curve."""
    place, system, number = _place(base, curve), base.model.system, len(base.candidates)
    if place is None or not _simulable(base, curve):
        return None
    bent = Bent(system, place, curve, tuple(float(v) for v in curve.values / place.size), number)
    try:
        return settle(with_effects(base, (*base.candidates, bent)), 1, 3)
    except PlantError:
        return None


def _many(knots: Floats) -> Floats:
    """As many knots as a curve in the simulation has, spread like those given."""
    return np.interp(np.linspace(0.0, knots.size - 1.0, KNOTS), np.arange(knots.size), knots)


def _rebent(curve: Curve) -> Curve:
    """Return the curve with knots nearer to each other where it bends."""
    z, f = curve.knots, curve.values
    bend = np.abs(np.diff(np.diff(f) / np.diff(z)))
    mass = np.convolve(np.pad(bend, 1), (0.5, 0.5), "valid") + 1e-300
    share = 0.5 * mass / mass.sum() + 0.5 * np.diff(z) / (z[-1] - z[0])
    reached = np.concatenate(([0.0], np.cumsum(share)))
    knots = np.interp(np.linspace(0.0, reached[-1], KNOTS), reached, z)
    return replace(curve, knots=knots, values=curve(knots))


def _pushed(base: Fit, curve: Curve) -> Fit | None:
    """Fit a curve as a course of pushes, its quantity taken anew as long as that helps much."""
    place = _place(base, curve)
    assert place is not None
    knots = curve.knots if curve.regressor == ANGLE else finer(curve.regressor, curve.knots)
    pushed = Pushed.beside(base, place, curve.regressor, knots)
    best = base
    for _ in range(ROUNDS):
        try:
            led = settle(with_effects(best, (*base.candidates, pushed)), 1, 3)
            fits = [_consistent(led, pushed.towards(_pushing(led), share)) for share in SHARES]
        except PlantError:
            break
        fit = max(fits, key=lambda f: f.score)
        gained, before = fit.score - best.score, best.score - base.score
        if gained > 0.0:
            best = fit
        if gained < FURTHER * before:
            break
        pushed = _pushing(best).again(best)
    return best if best is not base else None


def _consistent(fit: Fit, pushed: Pushed) -> Fit:
    """Return the fit with a curve along what the simulation does when the curve acts in it."""
    others = fit.candidates[:-1]
    for _ in range(PASSES):
        fit = with_effects(fit, (*others, pushed))
        pushed = pushed.along_that_of(fit)
    return with_effects(fit, (*others, pushed))


def _pushing(fit: Fit) -> Pushed:
    pushed = fit.candidates[-1]
    assert isinstance(pushed, Pushed)
    return pushed


def _standing(base: Fit, rough: Fit, held_out: Model | None) -> FreeCurve:
    """Let pushes stand in the simulation of both sets of recordings, and settle the rest."""
    pushed = _pushing(rough)
    place = pushed.place
    told = Curve(place.name, place.block, place.unit, pushed.regressor, pushed.knots,
                 pushed.values, 0.0, 0.0, 0.0, 0.0)  # fmt: skip
    fit = settle(refreshed(_with(base, rough, place, told)), noises=2, steps=3)
    if held_out is None:
        return FreeCurve(told, fit, fit.score - base.score, 0.0, None)
    confirmed, proven = _confirmed(base, fit, place, told, held_out)
    return FreeCurve(told, fit, fit.score - base.score, confirmed, proven)


def _with(base: Fit, at: Fit, place: Injection, curve: Curve) -> Fit:
    """Return the fit of `base` at the point of another with the curve acting in its simulation.

    The curve goes along what that other fit's simulation shows.
    """
    there = base.model.injected or ({},) * len(base.model.records)
    injected = tuple(
        _sum(before, injected_rows(at, r, place, curve)) for r, before in enumerate(there)
    )
    model = replace(base.model, injected=injected)
    effects = tuple(e for e in at.point.effects if not isinstance(e, Push))
    point = replace(at.point, effects=effects)
    kept = tuple(c for c in at.candidates if not isinstance(c, Pushed))
    return replace(at, model=model, point=point, predicted=predict(model, point), candidates=kept)


def _sum(one: Mapping[str, Floats], other: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return both sets of columns, added where they share one."""
    return {**one, **{k: v + one[k] if k in one else v for k, v in other.items()}}


def injected_rows(fit: Fit, r: int, place: Injection, curve: Curve) -> dict[str, Floats]:
    """Return the inputs by which a curve acts, row by row."""
    record = fit.model.records[r]
    seen = regressors(fit, place.drive, r)[curve.regressor]
    return fit.model.at(fit.point).push(place, record, curve(seen, record.grid.step))


def _confirmed(
    base: Fit, best: Fit, place: Injection, curve: Curve, held_out: Model
) -> tuple[float, Model]:
    """Return what a curve gains on the held-out recordings, and the model in which it acts there.

    Its quantity there is taken anew with the curve acting, as often as it was in the fit.
    """
    before = carried_over(base, held_out)
    there = replace(carried_over(replace(best, model=base.model), held_out), candidates=())
    for _ in range(PASSES):
        there = settle(_with(before, there, place, curve), noises=2)
    there = replace(there, candidates=best.candidates)
    return there.score - before.score, there.model

"""None of the above: a located curve is put into the simulation itself and fitted there.

Where the simulation knows a free curve at the place along the quantity, the curve is evaluated on
its own motion, so that what the curve does acts back on what drives it, and its values are fitted
jointly with everything that is uncertain. Knots move to where it bends. Elsewhere the curve acts
as an input, evaluated along its recorded regressor. Then it meets the held-out recordings.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.fit_external import FURTHER, spline_in, standing
from slipbench.identification.mismatch.curves.free_curve import FreeCurve
from slipbench.identification.mismatch.curves.input_spline import InputSpline
from slipbench.identification.mismatch.curves.locate import locate
from slipbench.identification.mismatch.curves.model_spline import (
    injection_of,
    newest,
    refined_knots,
    simulable,
    simulated,
    with_many_knots,
)
from slipbench.identification.mismatch.curves.scan import enough
from slipbench.identification.mismatch.fit.calibrate import at_prior_mean, far_from_prior
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.following import (
    refit_with_updated_jacobian,
    relinearized,
)
from slipbench.identification.mismatch.fit.held_out import CONFIRMED, refit_on
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.simulation.model import Model
from slipbench.identification.mismatch.simulation.regressor import ROUNDS, TURN, evenly_round
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

TRIED = 2
"""Located curves that are tried inside the simulation."""
AROUND = 5
"""Places at which a push along the turn of an angle is tried."""
BENDS = 2
"""How often knots move to where the curve bends."""
MOST = 3
"""Curves that may stand in together."""


def inside(base: Fit, curves: Sequence[Curve], held_out: Model | None) -> FreeCurve | None:
    """Put the best of the located curves into the simulation, and others beside it that help.

    None where all are of sensors.
    """
    found = _one(base, curves, held_out)
    while found is not None and held_out is not None and len(found.beside) + 1 < MOST:
        there = found.proven
        assert there is not None
        left = locate(Linearization.of(found.fit), Linearization.of(refit_on(found.fit, there)))
        other = _one(found.fit, [c for c in left if c.certain], there)
        if other is None or other.confirmed < max(CONFIRMED, FURTHER * found.confirmed):
            break
        found = found.with_another(other)
    return found


def _one(base: Fit, curves: Sequence[Curve], held_out: Model | None) -> FreeCurve | None:
    """Fit the best of the located curves beside those that are there already."""
    rough = base.coarse
    chosen = _chosen(base, curves)
    tried = [
        (start, fit) for start in _starts(rough) for curve in chosen for fit in _tried(start, curve)
    ]
    if not tried:
        return None
    start, best = max(tried, key=lambda t: t[1].score)
    if isinstance(best.candidates[-1], InputSpline):
        return standing(base, best, held_out)
    around = newest(best).told().kind == TURN
    for _ in range(0 if around else BENDS):
        again = simulated(start, refined_knots(newest(best).told()))
        if again is None or again.score < best.score:
            break
        best = again
    best = best.fine(base.model)
    best = refit_with_updated_jacobian(best) if around else optimize(relinearized(best))
    confirmed = 0.0
    if held_out is not None:
        confirmed = refit_on(best, held_out).score - refit_on(base, held_out).score
    return FreeCurve(newest(best).told(), best, best.score - base.score, confirmed, held_out)


def _starts(rough: Fit) -> Iterator[Fit]:
    """Yield where a curve is fitted from: also beside the file's numbers, if parameters are far from their priors.

    What made up for something missing stays where it went, and leaves a curve little to do.
    """
    yield rough
    if far_from_prior(rough):
        try:
            yield at_prior_mean(rough)
        except PlantError:
            return


def _chosen(base: Fit, curves: Sequence[Curve]) -> list[Curve]:
    """Return the first curves, and at the first's place the first of each further kind.

    What repeats with every turn is first sought at a wheel's teeth, and may as well push the wheel.
    """
    there = [c for c in curves if injection_of(base, c) is not None]
    if curves and curves[0].certain and curves[0].kind == TURN:
        turning = [c for c in there if c.kind == TURN]
        if turning:
            return turning[:AROUND]
    certain = [c for c in there if c.certain]
    if not certain:
        return there[:1]
    same = [c for c in certain if c.place == certain[0].place]
    first_of_kind = {c.kind: c for c in reversed(same)}
    return list({id(c): c for c in (*certain[:TRIED], *first_of_kind.values())}.values())


def _tried(rough: Fit, curve: Curve) -> Iterator[Fit]:
    if not simulable(rough, curve):
        fit = spline_in(rough, curve)
    elif curve.kind == TURN:
        fit = _around(rough, curve)
    else:
        fit = _with_knots(rough, curve, with_many_knots(curve.knots))
    if fit is not None:
        yield fit


def _around(rough: Fit, curve: Curve) -> Fit | None:
    """Fit a curve around a turn, of as many orders as bring what more knots must bring."""
    best, count = None, 0
    for many in ROUNDS:
        fit = _with_knots(rough, curve, evenly_round(many))
        if fit is None or (best and fit.score - best.score < enough(many - count)):
            break
        best, count = fit, many
    return best


def _with_knots(rough: Fit, curve: Curve, knots: Floats) -> Fit | None:
    return simulated(rough, replace(curve, knots=knots, values=curve(knots)))

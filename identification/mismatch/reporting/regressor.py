"""Regressor of a named effect: the quantity that explains its effect response best at its place.

The effect response is simulated, with and without the effect, so it contains no noise. At the
injection point of the effect, a free curve over every quantity is fitted to it by least squares.
The regressor is the quantity whose curve explains the largest share.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.curves.injection import places
from slipbench.identification.mismatch.curves.tooth_curve import discs
from slipbench.identification.mismatch.curves.trace import concatenated_bins, sensors_as_places
from slipbench.identification.mismatch.curves.whitened import WhitenedResponses
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.sensitivity import change
from slipbench.identification.mismatch.fit.sizing import limits
from slipbench.identification.mismatch.fit.stack import whiten_and_stack
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.model import predict
from slipbench.identification.mismatch.simulation.regressor import (
    ANGLE,
    DETAIL,
    TURN,
    kind_of,
    knots_for,
)
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

LEAST = 0.3
"""Share of an effect response that a regressor must explain."""
SIZES = (1.0, 0.1)
"""Fractions of the size at which the effect is simulated: small ones act linearly."""
NEARER = 0.01
"""Margin of explained share that another quantity needs over that of the place itself."""
PLAINER = 0.05
"""Margin of explained share that a history, hysteresis or scale needs over a static curve."""


def regressor_of(fit: Fit, number: int) -> str:
    """Return the regressor of effect `number` of a fit; empty: no quantity explains it."""
    pattern = fit.effects[number].pattern
    name = fit.model.system.acts_at(pattern) or pattern.subject.partition("/")[0]
    if any(disc.name == name for disc, _ in discs(fit)):
        return ANGLE
    if turn_regressor := fit.model.system.turn_of(pattern):
        return turn_regressor
    try:
        bare = _without(fit, number)
    except PlantError:
        return ""
    places_by_name = {p.name: p for p in (*places(bare), *sensors_as_places(bare))}
    name = name.replace("_", " ")
    place = places_by_name.get(name) or places_by_name.get(f"sensor of {name}")
    if place is None:
        return ""
    responses = np.stack(
        [_effect_response(bare, fit.effects[number], size) for size in SIZES], axis=1
    )
    shares = dict(_shares(bare, place, responses[:, responses.any(axis=0)]))
    preference = {
        n: s - PLAINER * bool(kind_of(n)) + NEARER * (n == name) for n, s in shares.items()
    }
    best = max(preference, key=lambda n: preference[n], default="")
    return best if best and shares[best] >= LEAST else ""


def _without(fit: Fit, number: int) -> Fit:
    other_effects = tuple(e for i, e in enumerate(fit.point.effects) if i != number)
    point = replace(fit.point, effects=other_effects)
    return replace(fit, point=point, predicted=predict(fit.model, point), candidates=())


def _effect_response(bare: Fit, effect: Candidate, size: float) -> Floats:
    """Return the whitened effect response at a fraction of the size; zeros: simulation failed."""
    if size < 1.0 and limits(effect.kind):
        size = 1.0  # a limit acts at small values
    try:
        scaled_effect = effect.resized(size * effect.size).effect()
        responses = change(
            bare.model, bare.point, (*bare.point.effects, scaled_effect), bare.predicted
        )
    except PlantError:
        return np.zeros(len(bare.whitened_residuals))
    return np.nan_to_num(
        whiten_and_stack(bare.model, bare.noise, responses), posinf=0.0, neginf=0.0
    )


def _shares(fit: Fit, place: InjectionPoint, responses: Floats) -> Iterator[tuple[str, float]]:
    """Yield every quantity with the largest share that a curve over it explains of one response.

    responses: whitened effect responses, none of them zero, (rows, k).
    """
    whitened, total_power = WhitenedResponses(fit), np.sum(responses**2, axis=0)
    regressors = whitened.regressors_of(place.subsystem) if total_power.size else []
    for name in regressors[0][1] if regressors else ():
        knots = knots_for(name, concatenated_bins(name, regressors))
        if kind_of(name) in (TURN, DETAIL) or knots.size < 3:
            continue
        tent_basis = whitened.unit_disturbances(place.subsystem, {name: knots})
        columns = place.size * whitened.columns(place, tent_basis)
        values = np.linalg.lstsq(columns, responses, rcond=1e-6)[0]
        residual_power = np.sum((responses - columns @ values) ** 2, axis=0)
        yield name, float(np.max(1.0 - residual_power / total_power))

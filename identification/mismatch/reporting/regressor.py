"""Along what a named effect acts: the quantity that tells its trace best at its place.

The trace is simulated, with and without the effect, so that no noise blurs it. At the place where
the effect acts, a free curve along every quantity is fitted to that trace by least squares; the
quantity whose curve explains the largest share of it is the regressor.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.curves.injection import places
from slipbench.identification.mismatch.curves.tooth_curve import discs
from slipbench.identification.mismatch.curves.trace import over_all, sensors_as_places
from slipbench.identification.mismatch.curves.whitened import Whitened
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
"""Share of a trace that a regressor must explain."""
SIZES = (1.0, 0.1)
"""Shares of its size at which the effect is simulated: curves answer to small ones linearly."""
NEARER = 0.01
"""Share by which another quantity must explain more than that of the place itself."""
PLAINER = 0.05
"""Share by which a history, a hysteresis or a scale must explain more than a value."""


def regressor_of(fit: Fit, number: int) -> str:
    """Return the quantity along which effect `number` of a fit acts; empty: none tells it."""
    pattern = fit.effects[number].pattern
    name = fit.model.system.acts_at(pattern) or pattern.subject.partition("/")[0]
    if any(disc.name == name for disc, _ in discs(fit)):
        return ANGLE
    if turn := fit.model.system.turn_of(pattern):
        return turn
    try:
        bare = _without(fit, number)
    except PlantError:
        return ""
    known = {p.name: p for p in (*places(bare), *sensors_as_places(bare))}
    name = name.replace("_", " ")
    place = known.get(name) or known.get(f"sensor of {name}")
    if place is None:
        return ""
    traces = np.stack([_trace(bare, fit.effects[number], size) for size in SIZES], axis=1)
    shares = dict(_shares(bare, place, traces[:, traces.any(axis=0)]))
    worth = {n: s - PLAINER * bool(kind_of(n)) + NEARER * (n == name) for n, s in shares.items()}
    best = max(worth, key=lambda n: worth[n], default="")
    return best if best and shares[best] >= LEAST else ""


def _without(fit: Fit, number: int) -> Fit:
    others = tuple(e for i, e in enumerate(fit.point.effects) if i != number)
    point = replace(fit.point, effects=others)
    return replace(fit, point=point, predicted=predict(fit.model, point), candidates=())


def _trace(bare: Fit, effect: Candidate, size: float) -> Floats:
    """Whitened change of all outputs by an effect at a share of its size; zeros: it cannot run."""
    if size < 1.0 and limits(effect.kind):
        size = 1.0  # a limit acts where it is small
    try:
        added = effect.resized(size * effect.size).effect()
        series = change(bare.model, bare.point, (*bare.point.effects, added), bare.predicted)
    except PlantError:
        return np.zeros(len(bare.whitened_residuals))
    return np.nan_to_num(whiten_and_stack(bare.model, bare.noise, series), posinf=0.0, neginf=0.0)


def _shares(fit: Fit, place: InjectionPoint, traces: Floats) -> Iterator[tuple[str, float]]:
    """Yield every quantity with the share that a curve along it explains of one of the traces.

    traces: whitened, none of them zero, (rows, k); the largest share counts.
    """
    whitened, whole = Whitened(fit), np.sum(traces**2, axis=0)
    seen = whitened.seen_by(place.subsystem) if whole.size else []
    for name in seen[0][1] if seen else ():
        knots = knots_for(name, over_all(name, seen))
        if kind_of(name) in (TURN, DETAIL) or knots.size < 3:
            continue
        tents = whitened.along(place.subsystem, {name: knots})
        columns = place.size * whitened.columns(place, tents)
        values = np.linalg.lstsq(columns, traces, rcond=1e-6)[0]
        left = np.sum((traces - columns @ values) ** 2, axis=0)
        yield name, float(np.max(1.0 - left / whole))

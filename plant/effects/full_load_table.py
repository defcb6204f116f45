"""Full-load table: the torque at full opening as it was measured, point by point.

An engine on a dynamometer gives a table, with dips and shoulders that no smooth hump has. It takes the
hump's place; the factor on the total torque remains to be calibrated.

Equation
--------
    T_full = f(w_e);   f: straight between its knots, level beyond them

Symbols
-------
    w_e     crank speed                     rad/s
    z0..    knots, increasing               rad/s
    f0..    full-load torque at the knots   N m

Trace
-----
The torque over engine speed, at all openings, in every gear alike.

Confused with
-------------
A dip of the torque.

Reference
---------
Heywood, "Internal Combustion Engine Fundamentals" (1988), chapter 2, on measured torque curves.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.plant.effects.effect import Hook
from slipbench.plant.effects.free_curve import KNOTS, QUANTITIES, F, FreeCurve, Z, broken_line
from slipbench.plant.signals import Floats


def measured(
    full_torque: float, engine_speed: float, knots: tuple[float, ...], values: tuple[float, ...]
) -> float:
    """Full-load torque [N m] at this speed, in place of the hump's."""
    return broken_line(engine_speed, knots, values)


@dataclass(frozen=True)
class FullLoadTable(FreeCurve):
    """The measured full-load torque over the engine speed."""

    name = "full_load_table"
    block = "engine"
    hooks = (Hook("full_torque", measured),)
    helpers = (broken_line,)
    tuples = {"knots": Z, "values": F}  # noqa: RUF012


def full_load_table(speed: Floats, torque: Floats) -> FullLoadTable:
    """The effect for a table. speed: rad/s, ascending; torque: N m; both of shape (points,).

    A table with more points than the effect has knots is thinned out: the points that stay are
    added one by one where the straight lines are farthest off.
    """
    kept = [0, speed.size - 1]
    while len(kept) < min(KNOTS, speed.size):
        error = np.abs(torque - np.interp(speed, speed[kept], torque[kept]))
        error[kept] = -1.0
        kept = sorted([*kept, int(np.argmax(error))])
    spare = KNOTS - len(kept)
    knots = np.append(speed[kept], speed[-1] + np.arange(1.0, spare + 1.0))
    values = np.append(torque[kept], np.full(spare, torque[-1]))
    points = dict(zip((*Z, *F), (*knots.tolist(), *values.tolist()), strict=True))
    return FullLoadTable(1.0, float(QUANTITIES.index("engine speed")), **points)

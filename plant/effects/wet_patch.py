"""Wet patch: on one section of the road the tyre finds less grip.

Water, dust or fresh bitumen change the friction at a place. The stiffness of the tyre is that of
its rubber and stays; the peak of the curve sinks.

Equation
--------
    mu *= 1 - d W(s);   W = (tanh((s - s_0) / b) - tanh((s - s_0 - l) / b)) / 2

Symbols
-------
    d     loss     of grip on the section        1   0.1 to 0.6 (absent 0)
    s_0   place    where it begins               m   50
    l     length   of the section                m   20
    b     rounding of its ends                   m   1
    s              distance since the start      m

Trace
-----
More slip for the same force, at the same place in every run.

Confused with
-------------
Grip with temperature or wear (no place): position bins. Grade, which moves the speed and hardly
the slip.

Reference
---------
Pacejka, "Tire and Vehicle Dynamics", 3rd edition (2012), chapter 4, on the scaling of friction;
Gustafsson, "Slip-based tire-road friction estimation", Automatica 33 (1997).
"""

import math
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import evenly, parameter


def moisten(
    rear_grip: float, distance: float, loss: float, place: float, length: float, rounding: float
) -> float:
    """The friction coefficient at this place."""
    begun = math.tanh((distance - place) / rounding)
    ended = math.tanh((distance - place - length) / rounding)
    return rear_grip * (1.0 - loss * 0.5 * (begun - ended))


@dataclass(frozen=True)
class WetPatch(Effect):
    """Less grip on one section of the road."""

    name = "wet_patch"
    block = "road"
    shows_in = ("rear_teeth", "engine_speed")
    confused_with = ("grip_temperature", "grip_wear", "grade")
    hooks = (Hook("rear_grip", moisten),)

    loss: float = parameter(
        0.4, "1", -1.0, 0.95, "of grip on the section", absent=0.0, smallest=0.1
    )
    place: float = parameter(
        50.0, "m", -1e4, 1e5, "where it begins", sought=evenly(0.0, 400.0, 10.0)
    )
    length: float = parameter(20.0, "m", 0.0, 1e5, "of the section")
    rounding: float = parameter(1.0, "m", 0.1, 1e3, "of its ends")

"""Grade: a section of the road rises or falls.

No test track is level. One per cent of slope weighs as much as a light wind, and it is always at
the same place.

Equation
--------
    F = -m g i W(s);   W = (tanh((s - s_0) / b) - tanh((s - s_0 - l) / b)) / 2

Symbols
-------
    i     slope    of the section, positive is up     1   -0.02 to 0.02 (absent 0)
    s_0   place    where it begins                    m   50
    l     length   of the section                     m   200
    b     rounding of its ends                        m   10
    s              distance since the start           m

Trace
-----
A steady force, 25 N for one per cent, at the same place in every run, whatever the input does.

Confused with
-------------
Drag and wind (not bound to a place): ride the section in both directions.

Reference
---------
Guzzella and Sciarretta, "Vehicle Propulsion Systems", 3rd edition (2013), chapter 2; ISO 10521-1
on road load.
"""

import math
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import evenly, parameter


def climb(
    drag_force: float,
    distance: float,
    body_mass: float,
    slope: float,
    place: float,
    length: float,
    rounding: float,
) -> float:
    """The force against the motion [N]."""
    begun = math.tanh((distance - place) / rounding)
    ended = math.tanh((distance - place - length) / rounding)
    return drag_force + 9.80665 * body_mass * slope * 0.5 * (begun - ended)


@dataclass(frozen=True)
class Grade(Effect):
    """Slope of the road on one section."""

    name = "grade"
    block = "road"
    shows_in = ("optical_speed", "front_teeth", "rear_teeth")
    confused_with = ("wind", "wet_patch")
    hooks = (Hook("drag_force", climb),)

    slope: float = parameter(
        0.01, "1", -0.3, 0.3, "of the section, positive is up", absent=0.0, smallest=0.003
    )
    place: float = parameter(
        50.0, "m", -1e4, 1e5, "where it begins", sought=evenly(0.0, 400.0, 50.0)
    )
    length: float = parameter(200.0, "m", 0.0, 1e5, "of the section")
    rounding: float = parameter(10.0, "m", 0.5, 1e3, "of its ends")

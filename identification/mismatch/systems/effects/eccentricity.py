"""Eccentricity: a scale that rotates off its centre has an error once per turn.

An encoder disc, a potentiometer or a magnet beside the axis adds a sine of one turn to the angle, or
to whatever else is read from it.

Equation
--------
    y += A sin(a + phase)

Symbols
-------
    A       amplitude   of the reading           of the quantity   0.01 to 0.2 of it (absent 0)
    phase   phase       where it is at a = 0     rad
    a                   an angle: a state or an input

Trace
-----
What is left over repeats with every turn, at any speed and load.

Confused with
-------------
Unbalance (a force: goes with slow motion, hardly with fast), scale where the angle moves little.

Reference
---------
Renishaw, "The accuracy of rotary encoders" (white paper).
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import OUTPUT, SeamEffect
from slipbench.plant.parameters import parameter


def read(value: float, other: float, amplitude: float, phase: float) -> float:
    """Return the reading."""
    return value + amplitude * math.sin(other + phase)


@dataclass(frozen=True)
class Eccentricity(SeamEffect):
    """An error of a reading once a turn."""

    name = "eccentricity"
    block = "seam"
    confused_with = ("unbalance", "scale")
    acts_on = (OUTPUT,)
    uses = "turn"
    act = read

    amplitude: float = parameter(
        0.05, "[seam]", 0.0, 1.0, "of the reading", absent=0.0, smallest=0.01
    )
    phase: float = parameter(0.0, "rad", -math.pi, math.pi, "where it is at angle zero")

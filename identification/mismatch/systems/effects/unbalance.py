"""Unbalance: gravity exerts a force once per turn on a rotating part.

A link whose centre of mass is off its axis, a crank, an eccentric wheel: the force is a sine of the
angle.

Equation
--------
    f += A sin(a + phase)

Symbols
-------
    A       amplitude   of the force             of the seam   0.02 to 1 of it (absent 0)
    phase   phase       where it is at a = 0     rad
    a                   an angle: a state or an input

Trace
-----
What is left over is a sine over the angle, at any speed; without drive the part swings to its lowest
place.

Confused with
-------------
Cogging (several periods in a turn), offset where the angle hardly changes, cubic of the angle: motion
over half a turn and more.

Reference
---------
Duclusaud, Passault, Padois and Ly, "Extended friction models for the physics simulation of servo
actuators", arXiv 2410.08650 (2024): the torque of gravity on the pendulum of the test bench.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def pull(value: float, other: float, amplitude: float, phase: float) -> float:
    """Return the force plus that of gravity."""
    return value + amplitude * math.sin(other + phase)


@dataclass(frozen=True)
class Unbalance(SeamEffect):
    """A force once a turn."""

    name = "unbalance"
    block = "seam"
    confused_with = ("cogging", "offset", "cubic")
    acts_on = (SEAM,)
    uses = "turn"
    act = pull

    amplitude: float = parameter(0.2, "[seam]", 0.0, 3.0, "of the force", absent=0.0, smallest=0.03)
    phase: float = parameter(0.0, "rad", -math.pi, math.pi, "where it is at angle zero")

"""Cogging: a torque that is periodic in the angle of rotation.

Magnets attract the teeth of the iron, also without current; gears, belts and rollers press harder
once per tooth. The order is the number of periods in a turn.

Equation
--------
    f += A sin(n a + phase)

Symbols
-------
    A       amplitude   of the force             of the seam   0.02 to 0.5 of it (absent 0)
    n       order       periods in a turn        1             2 to 29
    phase   phase       where it is at a = 0     rad
    a                   an angle: a state or an input

Trace
-----
Ripple whose frequency goes with speed and whose size does not; a drive that rests, rests at certain
angles.

Confused with
-------------
Torque ripple (goes with the torque itself): runs with and without load. Unbalance (once a turn).

Reference
---------
Hsiao, Yeh and Hwang, "A novel cogging torque simulation method for permanent-magnet synchronous
machines", Energies 4 (2011) 2166 to 2179.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def cog(value: float, other: float, amplitude: float, order: float, phase: float) -> float:
    """Return the force plus the periodic force."""
    return value + amplitude * math.sin(order * other + phase)


@dataclass(frozen=True)
class Cogging(SeamEffect):
    """A force by angle."""

    name = "cogging"
    block = "seam"
    confused_with = ("torque_ripple", "unbalance")
    acts_on = (SEAM,)
    uses = "turn"
    variants = (1.0, 2.4, 3.8, 5.2)
    varies = "order"
    act = cog

    amplitude: float = parameter(0.1, "[seam]", 0.0, 3.0, "of the force", absent=0.0, smallest=0.03)
    order: float = parameter(5.0, "1", 2.0, 29.0, "periods in a turn", whole=True)
    phase: float = parameter(0.0, "rad", -math.pi, math.pi, "where it is at angle zero")

"""Torque ripple: the torque of a drive at constant current varies periodically with its angle.

Commutation, uneven windings and the mesh of gears make the gain of a drive periodic. Without torque
there is no ripple.

Equation
--------
    f *= 1 + a sin(n a + phase)

Symbols
-------
    a       share   of the quantity          1     0.02 to 0.5 (absent 0)
    n       order   periods in a turn        1     2 to 29
    phase   phase   where it is at angle 0   rad

Trace
-----
Ripple whose frequency goes with speed and whose size with the load.

Confused with
-------------
Cogging (is there without load), gain with a tilt: runs with and without load.

Reference
---------
Hsiao, Yeh and Hwang, "A novel cogging torque simulation method for permanent-magnet synchronous
machines", Energies 4 (2011) 2166 to 2179, which distinguishes it from cogging.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def ripple(value: float, other: float, share: float, order: float, phase: float) -> float:
    """Return the quantity times the gain at this angle."""
    return value * (1.0 + share * math.sin(order * other + phase))


@dataclass(frozen=True)
class TorqueRipple(SeamEffect):
    """A gain by angle."""

    name = "torque_ripple"
    block = "seam"
    confused_with = ("cogging", "gain_with_tilt")
    acts_on = (SEAM,)
    uses = "turn"
    variants = (1.0, 2.4, 3.8, 5.2)
    varies = "order"
    act = ripple

    share: float = parameter(0.1, "1", 0.0, 1.0, "of the quantity", absent=0.0, smallest=0.03)
    order: float = parameter(5.0, "1", 2.0, 29.0, "periods in a turn", whole=True)
    phase: float = parameter(0.0, "rad", -math.pi, math.pi, "where it is at angle zero")

"""Presliding friction: before a contact slides it is elastic.

Asperities deform. After each reversal the force does not jump: it reverses over a short distance,
within which the joint is elastic.

Equation
--------
    z' = v (1 - z sign v / s),   f -= F z / s   (Dahl)

Symbols
-------
    F   force      of dry friction                  of the seam        0.02 to 0.5 of it (absent 0)
    s   distance   within which the force is reached   of the distance   0.1 to 10 usual speeds times periods
    v              speed of the seam (`along`)
    z              deflection of the contact

Trace
-----
Small motion sees a stiffness and a loop instead of a stop; after reversals force follows distance,
at any speed.

Confused with
-------------
Friction (reverses at once, with speed) where the distance is below that of one sample; hysteresis
(of the quantity itself): reversals of small amplitude.

Reference
---------
Olsson, Astrom, Canudas de Wit, Gafvert and Lischinsky, "Friction models and friction compensation"
(1997), section on the Dahl model.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def bend(
    value: float,
    other: float,
    memory: float,
    second: float,
    elapsed: float,
    force: float,
    distance: float,
) -> tuple[float, float, float]:
    """Return the force that remains, the deflection as a share, and the speed.

    Exact for a constant speed; otherwise the mean of the speed before and now acts.
    """
    way = 0.5 * (second + other) * elapsed / distance
    end = math.copysign(1.0, way)
    bent = end + (memory - end) * math.exp(-abs(way))
    return value - force * bent, bent, other


@dataclass(frozen=True)
class Presliding(SeamEffect):
    """Dry friction that builds up over a distance."""

    name = "presliding"
    block = "seam"
    confused_with = ("friction", "hysteresis")
    acts_on = (SEAM,)
    uses = "along"
    remembers = 2
    starts = (0.0, 0.0)
    variants = (1.0, 0.2)
    varies = "distance"
    act = bend

    force: float = parameter(0.15, "[seam]", 0.0, 3.0, "of dry friction", absent=0.0, smallest=0.03)
    distance: float = parameter(2.0, "[other*time]", 1e-3, 1e3, "within which the force is reached")

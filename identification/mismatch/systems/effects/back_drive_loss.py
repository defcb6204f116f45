"""Back-drive loss: a gear transmits less force when its load drives it.

A worm, a screw or a harmonic drive slides at an angle that helps in one direction of power and
jams in the other. Where the load drives, a further share is lost; some gears lock.

Equation
--------
    f -= mu |f| tanh(v / v_r)   while f v < 0

Symbols
-------
    mu    share   of the force that is lost          1              0.05 to 2; 1: it locks (absent 0)
    v_r   creep   speed within which it reverses     of the speed   0.01 of the usual one
    v             speed of the seam (`along`)

Trace
-----
Raising a load is as it was; lowering it, or braking it, takes less holding drive than gravity asks.

Confused with
-------------
Load-dependent friction (in both directions of power); friction by direction (of motion, without
regard to load); asymmetry of the force: a run in which the load drives in both directions.

Reference
---------
Model M5 of Duclusaud, Passault, Padois and Ly, "Extended friction models for the physics simulation
of servo actuators", arXiv 2410.08650 (2024): loads of motor and of output side weigh differently.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def lose(value: float, other: float, share: float, creep: float) -> float:
    """Return the remaining force."""
    driven = 1.0 if value * other < 0.0 else 0.0
    return value - driven * share * abs(value) * math.tanh(other / creep)


@dataclass(frozen=True)
class BackDriveLoss(SeamEffect):
    """Loss where the load drives."""

    name = "back_drive_loss"
    block = "seam"
    confused_with = ("load_friction", "friction_by_direction", "asymmetry")
    acts_on = (SEAM,)
    uses = "along"
    act = lose

    share: float = parameter(
        0.3, "1", 0.0, 3.0, "of the force that is lost", absent=0.0, smallest=0.06
    )
    creep: float = parameter(0.01, "[other]", 1e-4, 1.0, "speed within which it turns over")

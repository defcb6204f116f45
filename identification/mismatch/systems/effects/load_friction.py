"""Load-dependent friction: friction in proportion to the transmitted force.

In a gear, a screw or a loaded bearing the normal force grows with what is transmitted, and friction
with it. A share of every force is lost, whichever way it acts.

Equation
--------
    f -= mu |f| tanh(v / v_r)

Symbols
-------
    mu    share   of the transmitted force that rubs   1              0.03 to 0.6 (absent 0)
    v_r   creep   speed within which it reverses       of the speed   0.01 of the usual one
    v             speed of the seam (`along`)

Trace
-----
Motion under load costs more drive than motion without: lifting takes 1 / (1 - mu) of the weight,
lowering gives back 1 / (1 + mu) of it.

Confused with
-------------
Friction (the same without load): runs with small and with large load. Back-drive loss (only where
the load drives): lifting as well as lowering. Scale: the same for both directions of motion.

Reference
---------
Model M3 of Duclusaud, Passault, Padois and Ly, "Extended friction models for the physics simulation
of servo actuators", arXiv 2410.08650 (2024).
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def rub(value: float, other: float, share: float, creep: float) -> float:
    """Return the remaining force."""
    return value - share * abs(value) * math.tanh(other / creep)


@dataclass(frozen=True)
class LoadFriction(SeamEffect):
    """Friction in proportion to the transmitted force."""

    name = "load_friction"
    block = "seam"
    confused_with = ("friction", "back_drive_loss", "scale")
    acts_on = (SEAM,)
    uses = "along"
    act = rub

    share: float = parameter(
        0.15, "1", 0.0, 0.95, "of the force that rubs", absent=0.0, smallest=0.03
    )
    creep: float = parameter(0.01, "[other]", 1e-4, 1.0, "speed within which it turns over")

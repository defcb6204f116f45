"""Closed-throttle friction: behind a closed plate the pistons pump against a vacuum.

With the throttle open the gas exchange costs little. With the throttle closed each intake stroke
pulls against the vacuum of the manifold, and the engine brakes more than its rubbing friction.

Equation
--------
    T_f += P (w_e / 1000) exp(-air / th_p)

Symbols
-------
    P     pumping   at 1000 rad/s behind a closed plate   N m     3 to 10 (absent 0)
    th_p  opening   at which it has fallen to 37 %        1       0.02 to 0.05
    w_e             crank speed                           rad/s

Trace
-----
More braking at low throttle, growing with engine speed; above some openings nothing.

Confused with
-------------
Drag of the air or rolling drag: a coast-down with the clutch pulled has only those. Torque dip: it
is tied to a speed, this one to the opening.

Reference
---------
Heywood, "Internal Combustion Engine Fundamentals" (1988), chapter 13, on pumping friction.
"""

import math
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def pump(
    friction_torque: float, engine_speed: float, charge: float, pumping: float, opening: float
) -> float:
    """The friction [N m] with the work of pumping."""
    vacuum = math.exp(-max(charge, 0.0) / opening)
    return friction_torque + pumping * 1e-3 * engine_speed * vacuum


@dataclass(frozen=True)
class ClosedThrottleFriction(Effect):
    """Pumping work behind a closed plate."""

    name = "closed_throttle_friction"
    block = "engine"
    shows_in = ("engine_speed", "rear_teeth")
    confused_with = ("torque_dip", "driveline_loss", "wind")
    hooks = (Hook("friction_torque", pump),)

    pumping: float = parameter(
        6.0, "N m", 0.0, 40.0, "at 1000 rad/s behind a closed plate", absent=0.0, smallest=1.5
    )
    opening: float = parameter(0.03, "1", 5e-3, 0.3, "at which it falls to 37 %")

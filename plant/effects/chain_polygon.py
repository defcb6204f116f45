"""Chain polygon: a chain lies on its sprocket as a polygon and pulls at a changing radius.

Each link that meets the sprocket lifts the chain from the flat of the polygon to its corner. The
wheel is driven a little faster and slower once a tooth of the sprocket.

Equation
--------
    phi_s = phi + (e / z) sin(z psi + phase),   phi_s' = phi' + e w_r cos(z psi + phase)

Symbols
-------
    e      ripple   relative amplitude of the chain's speed   1     1e-3 to 5e-3 (absent 0)
    z      teeth    of the sprocket                       1     40 to 45
    phase  phase    where the first tooth stands          rad   0
    psi             angle of the rear wheel               rad
    phi             twist of the driveline                rad

Trace
-----
One line at order z of the wheel. An encoder of N_t teeth shows it at the order to which z folds: 42
appears as 6 with 16 teeth.

Confused with
-------------
Tooth errors of the encoder: their lines keep their share of the speed when coasting with a slack
chain, this one vanishes.

Reference
---------
Binder, "Mechanics of the Roller Chain Drive" (1956); Cossalter, "Motorcycle Dynamics", 2nd edition
(2006), on the chain.
"""

import math
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def roll_over_corners(
    spring_twist: float,
    spring_rate: float,
    rear_angle: float,
    rear_speed: float,
    ripple: float,
    teeth: float,
    phase: float,
) -> tuple[float, float]:
    """Twist [rad] and rate [rad/s] that the driveline feels."""
    angle = teeth * rear_angle + phase
    lead, rate = ripple / teeth * math.sin(angle), ripple * rear_speed * math.cos(angle)
    return spring_twist + lead, spring_rate + rate


@dataclass(frozen=True)
class ChainPolygon(Effect):
    """Ripple of the chain once a tooth of the sprocket."""

    name = "chain_polygon"
    block = "driveline"
    shows_in = ("rear_teeth",)
    confused_with = ("tooth_misplacement", "eccentricity", "firing_torque", "compression_torque")
    periodic = True
    hooks = (Hook("spring_motion", roll_over_corners),)

    ripple: float = parameter(
        3e-3, "1", 0.0, 0.05, "relative amplitude of the chain's speed", absent=0.0, smallest=1e-3
    )
    teeth: float = parameter(42, "1", 8, 80, "of the sprocket", whole=True)
    phase: float = parameter(0.0, "rad", -math.pi, math.pi, "where the first tooth stands")

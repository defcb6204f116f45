"""Load transfer: accelerating presses the rear tyre onto the road.

The centre of gravity lies high above a short wheelbase. Acceleration moves load from the front to
the rear, up to a wheelie, and the tyre gets stiffer and stronger with it.

Equation
--------
    F_z += m (h / L) b,   b' = (a - b) / tau;   0 <= F_z <= m g

Symbols
-------
    h/L   height       of the centre of gravity over the wheelbase   1       0.44 (absent 0)
    tau   settling     of the suspension                             s       0.02
    a                  acceleration                                  m/s^2
    b     felt         acceleration that the tyre feels (a state)    m/s^2
    m, g               mass, gravity

Trace
-----
Slip grows less than the force: its gain falls with acceleration, the same in every gear.

Confused with
-------------
Torque dip (another gear), radius growth and a higher friction: wide excitation at high speed
separates them.

Reference
---------
Cossalter, "Motorcycle Dynamics", 2nd edition (2006), on load transfer in acceleration.
"""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def press(rear_load: float, felt: float, body_mass: float, height: float) -> float:
    """The load on the rear tyre [N]."""
    moved = rear_load + body_mass * height * felt
    return min(max(moved, 0.0), max(rear_load, 9.80665 * body_mass))


def settle(acceleration: float, felt: float, settling: float) -> tuple[float, float]:
    """The acceleration [m/s^2] and the rate of the felt one [m/s^3]."""
    return acceleration, (acceleration - felt) / settling


@dataclass(frozen=True)
class LoadTransfer(Effect):
    """Load of the rear tyre that goes with acceleration."""

    name = "load_transfer"
    block = "tyre"
    shows_in = ("rear_teeth", "suspension_travel")
    confused_with = ("torque_dip", "radius_growth", "squat", "grip_temperature")
    states = ("felt",)
    starts = (0.0,)
    hooks = (Hook("rear_load", press), Hook("acceleration", settle, governs=("felt",)))

    height: float = parameter(
        0.44, "1", 0.0, 1.0, "of the centre of gravity over wheelbase", absent=0.0, smallest=0.1
    )
    settling: float = parameter(0.02, "s", 2e-3, 1.0, "of the suspension")

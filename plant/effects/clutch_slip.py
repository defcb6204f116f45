"""Clutch slip: worn or hot plates pass less torque than they should.

A clutch holds as long as the torque stays below what its springs and linings allow. Beyond that the
engine runs up while the wheel does not follow.

Equation
--------
    |T_d / N| <= T_cap

Symbols
-------
    T_cap   capacity   greatest torque at the crank   N m   60 to 200 (absent: infinite)
    T_d / N            driveline torque at the crank  N m

Trace
-----
Engine speed over wheel speed leaves the gear's ratio at high torque and comes back; the wheel's
acceleration has a ceiling.

Confused with
-------------
Slip of the tyre: that leaves engine speed over wheel speed alone. Slipper clutch: only while
braking.

Reference
---------
Dolcini, Canudas de Wit and Bechart, "Dry Clutch Control for Automotive Applications" (2010).
"""

from dataclasses import dataclass
from math import inf

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def let_slip(clutch_capacity: float, clutch: float, gear_ratio: float, capacity: float) -> float:
    """The greatest torque that the clutch passes, at the wheel [N m]."""
    worn = capacity * gear_ratio * clutch if clutch > 0.0 else 0.0
    return min(clutch_capacity, worn)


@dataclass(frozen=True)
class ClutchSlip(Effect):
    """A clutch that passes less than it should."""

    name = "clutch_slip"
    block = "driveline"
    shows_in = ("engine_speed", "rear_teeth")
    confused_with = ("slipper_clutch", "backlash")
    hooks = (Hook("clutch_capacity", let_slip),)

    capacity: float = parameter(
        100.0, "N m", 10.0, 1000.0, "greatest torque at the crank", absent=inf, smallest=150.0
    )

"""Slipper clutch: ramps in the clutch open it when the wheel drives the engine too hard.

Without it a closed throttle in a low gear makes the rear wheel hop. The ramps lift the pressure
plate as soon as the braking torque exceeds a limit, and the engine falls behind the wheel.

Equation
--------
    T_d / N >= -T_b

Symbols
-------
    T_b     back_torque   greatest braking torque at the crank   N m   8 to 40 (absent: infinite)
    T_d / N               driveline torque at the crank          N m

Trace
-----
While closing, engine speed falls below that of the wheel times the ratio; engine braking has a
ceiling. Driving is untouched.

Confused with
-------------
Backlash (also at the change to braking, but it closes again at once); clutch slip (when driving).

Reference
---------
Cossalter, "Motorcycle Dynamics", 2nd edition (2006), on engine braking; Corno, Panzani and
Savaresi, "Single-track vehicle dynamics control", IEEE/ASME Transactions on Mechatronics 20
(2015).
"""

from dataclasses import dataclass
from math import inf

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def open_ramps(driveline_torque: float, gear_ratio: float, back_torque: float) -> float:
    """The torque of the driveline [N m], braking no more than the ramps allow."""
    return max(driveline_torque, -back_torque * gear_ratio)


@dataclass(frozen=True)
class SlipperClutch(Effect):
    """Ceiling of the engine braking."""

    name = "slipper_clutch"
    block = "driveline"
    shows_in = ("engine_speed", "rear_teeth")
    confused_with = ("clutch_slip", "backlash")
    hooks = (Hook("driveline_torque", open_ramps),)

    back_torque: float = parameter(
        15.0, "N m", 2.0, 500.0, "greatest braking torque at the crank", absent=inf, smallest=30.0
    )

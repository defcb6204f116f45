"""Voltage limit: the faster the throttle motor turns, the less torque the supply can give it.

At standstill the whole battery voltage drives current through the winding. As the motor gains
speed its back-EMF uses that voltage up, and at the no-load speed nothing is left to accelerate.

Equation
--------
    -A (1 + th' / R) <= th'' <= A (1 - th' / R),   each share not below 2 %

Symbols
-------
    A   stall_acceleration   greatest acceleration at rest   1/s^2   250 to 800 (absent: infinite)
    R   no_load_speed        where nothing is left           1/s     8 to 20

Trace
-----
Large steps begin as a parabola and end as an exponential towards the no-load speed; braking is
stronger than accelerating.

Confused with
-------------
Rate limit (a sharp ceiling of the rate) and acceleration limit (no fading with speed): a large step
from rest shows which part of the ramp is bent.

Reference
---------
Scattolini et al., "Modeling and control of an electronic throttle body", Control Engineering
Practice 5 (1997).
"""

from dataclasses import dataclass
from math import inf

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def limit_push(
    servo_acceleration: float, throttle_rate: float, stall_acceleration: float, no_load_speed: float
) -> float:
    """The acceleration [1/s^2] that the voltage left over by the back-EMF allows."""
    x = throttle_rate / no_load_speed
    opening = stall_acceleration * max(1.0 - x, 0.02)
    closing = stall_acceleration * max(1.0 + x, 0.02)
    return min(max(servo_acceleration, -closing), opening)


@dataclass(frozen=True)
class VoltageLimit(Effect):
    """Push of the throttle motor that fades with its speed."""

    name = "voltage_limit"
    block = "throttle_servo"
    shows_in = ("throttle_position",)
    confused_with = ("rate_limit", "acceleration_limit")
    hooks = (Hook("servo_acceleration", limit_push),)

    stall_acceleration: float = parameter(
        300.0, "1/s^2", 20.0, 1e5, "greatest acceleration at rest", absent=inf, smallest=600.0
    )
    no_load_speed: float = parameter(12.0, "1/s", 1.0, 100.0, "speed at which no torque remains")

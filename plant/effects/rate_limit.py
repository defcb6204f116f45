"""Rate limit: the throttle motor turns no faster than its supply lets it.

At full voltage the motor reaches a speed at which its back-EMF leaves no torque to spare. Small
and slow commands never see it; a step of half the range turns into a ramp.

Equation
--------
    |th'| <= R;   at the limit th'' does not push further

Symbols
-------
    R   limit   greatest speed of the plate   1/s   2.5 to 12 (250 to 1200 %/s; absent: infinite)

Trace
-----
Triangles instead of sines, with odd harmonics, only where amplitude times frequency is large.

Confused with
-------------
A limit of acceleration or voltage: a sweep at several amplitudes separates them, since this one
depends on amplitude times frequency and that one on amplitude times frequency squared.

Reference
---------
Scattolini et al., "Modeling and control of an electronic throttle body", Control Engineering
Practice 5 (1997).
"""

from dataclasses import dataclass
from math import inf

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def limit_velocity(servo_velocity: float, limit: float) -> float:
    """The plate's velocity [1/s], no faster than the limit."""
    return min(max(servo_velocity, -limit), limit)


def hold_at_limit(
    servo_acceleration: float, throttle_rate: float, limit: float, step: float
) -> float:
    """The acceleration [1/s^2]; where it would exceed the limit, back onto it."""
    if abs(throttle_rate) < limit or servo_acceleration * throttle_rate <= 0.0:
        return servo_acceleration
    return (min(max(throttle_rate, -limit), limit) - throttle_rate) / step


@dataclass(frozen=True)
class RateLimit(Effect):
    """Greatest speed of the throttle plate."""

    name = "rate_limit"
    block = "throttle_servo"
    shows_in = ("throttle_position",)
    confused_with = ("acceleration_limit", "voltage_limit")
    hooks = (Hook("servo_velocity", limit_velocity), Hook("servo_acceleration", hold_at_limit))

    limit: float = parameter(
        6.0, "1/s", 0.5, 100.0, "greatest speed of the plate", absent=inf, smallest=12.0
    )

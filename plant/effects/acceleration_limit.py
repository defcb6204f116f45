"""Acceleration limit: the servo's current is limited, and with it the torque on the plate.

The power stage protects itself and the motor by a greatest current. Torque follows current, so
that however large the error, the plate cannot gain speed faster than that.

Equation
--------
    |th''| <= A

Symbols
-------
    A   limit   greatest acceleration of the plate   1/s^2   150 to 400 (absent: infinite)

Trace
-----
The start of a large step is a parabola, the same for all large steps; sines turn into arcs of
parabolas where amplitude times frequency squared is large.

Confused with
-------------
Rate limit: its onset grows with amplitude times frequency, this one with frequency squared, so a
sweep at several amplitudes separates them. Voltage limit: there the push also fades with speed.

Reference
---------
Deur, Pavkovic, Peric, Jansz and Hrovat, "An electronic throttle control strategy including
compensation of friction and limp-home effects", IEEE Transactions on Industry Applications 40
(2004).
"""

from dataclasses import dataclass
from math import inf

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def limit_acceleration(servo_acceleration: float, limit: float) -> float:
    """The acceleration of the plate [1/s^2], no more than the limit."""
    return min(max(servo_acceleration, -limit), limit)


@dataclass(frozen=True)
class AccelerationLimit(Effect):
    """Greatest acceleration of the throttle plate."""

    name = "acceleration_limit"
    block = "throttle_servo"
    shows_in = ("throttle_position",)
    confused_with = ("rate_limit", "voltage_limit")
    hooks = (Hook("servo_acceleration", limit_acceleration),)

    limit: float = parameter(
        250.0, "1/s^2", 20.0, 1e5, "greatest acceleration of the plate", absent=inf, smallest=400.0
    )

"""Grip with temperature: a sliding tyre heats itself and loses its grip.

Slip turns power into heat in the tread. Above its best temperature the rubber grips less; between
two pulls it cools again.

Equation
--------
    mu *= 1 + c q,   q' = (h |F_x v lambda| - q) / tau;   the factor within 0.3 .. 1.7

Symbols
-------
    c     sensitivity   of the grip               1/K    -3e-3 (absent 0)
    h     heating       of the tread by power     K/W    0.05
    tau   cooling       time of the tread         s      10 to 60
    q     warmth        over the nominal (a state) K
    F_x, v, lambda      force, speed, slip

Trace
-----
Only near the peak of the curve: the same force needs more slip late in a pull than early in it.
Small slip hardly shows it.

Confused with
-------------
Grip by place (position bins), wear (does not come back after a rest), load transfer.

Reference
---------
Kelly and Sharp, "Time-optimal control of the race car: influence of a thermodynamic tyre model",
Vehicle System Dynamics 50 (2012).
"""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def soften(rear_grip: float, warmth: float, sensitivity: float) -> float:
    """The friction coefficient of the warm tyre."""
    return rear_grip * min(max(1.0 + sensitivity * warmth, 0.3), 1.7)


def heat(
    tyre_force: float, slip: float, speed: float, warmth: float, heating: float, cooling: float
) -> tuple[float, float]:
    """The force [N] and the rate of the warmth [K/s]."""
    power = abs(tyre_force * slip * speed)
    return tyre_force, (heating * power - warmth) / cooling


@dataclass(frozen=True)
class GripTemperature(Effect):
    """Grip that falls as the tread warms up."""

    name = "grip_temperature"
    block = "tyre"
    shows_in = ("rear_teeth", "temperatures")
    confused_with = ("wet_patch", "grip_wear", "load_transfer", "air_density")
    states = ("warmth",)
    starts = (20.0,)
    hooks = (Hook("rear_grip", soften), Hook("tyre_force", heat, governs=("warmth",)))

    sensitivity: float = parameter(
        -3e-3, "1/K", -0.02, 0.02, "of the grip", absent=0.0, smallest=-1e-3
    )
    heating: float = parameter(0.05, "K/W", 0.0, 0.5, "of the tread by power")
    cooling: float = parameter(30.0, "s", 0.5, 600.0, "time of the tread")

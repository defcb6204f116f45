"""Grip with wear: the grip falls with every kilometre.

Rubber wears off and hardens. The peak of the curve sinks with the distance ridden and does not come
back.

Equation
--------
    mu *= max(1 - w s, 0.3)

Symbols
-------
    w   wear   loss of grip over distance   1/m   5e-6 to 5e-5 (absent 0)
    s          distance since the start     m

Trace
-----
Slip at the same force grows from run to run, near the peak only.

Confused with
-------------
Grip with temperature, which recovers after a rest; grip by place, which returns every lap.

Reference
---------
Grosch, "The rolling resistance, wear and traction properties of tread compounds", Rubber Chemistry
and Technology 69 (1996).
"""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def wear_off(rear_grip: float, distance: float, wear: float) -> float:
    """The friction coefficient after this distance."""
    return rear_grip * min(max(1.0 - wear * distance, 0.3), 1.0)


@dataclass(frozen=True)
class GripWear(Effect):
    """Grip that sinks with the distance ridden."""

    name = "grip_wear"
    block = "tyre"
    shows_in = ("rear_teeth",)
    confused_with = ("grip_temperature", "wet_patch")
    hooks = (Hook("rear_grip", wear_off),)

    wear: float = parameter(
        2e-5, "1/m", 0.0, 1e-3, "loss of grip over distance", absent=0.0, smallest=5e-6
    )

"""Optical scale: the speed sensor reads a fixed share too much or too little.

Its grating constant holds for one height above the road. Mounted higher or lower, or calibrated on
another surface, every speed is wrong by the same factor.

Equation
--------
    s = (1 + e) v

Symbols
-------
    e   error   of the scale   1     -0.01 to 0.01 (absent 0)
    v           true speed     m/s

Trace
-----
Optical speed over wheel speed differs from the radius by one factor, driven or coasting, at every
speed.

Confused with
-------------
A wrong front radius (the same thing, unless the radius was measured); radius growth (grows with
speed); mounting angle (changes with acceleration): a coast-down from high speed.

Reference
---------
Data sheets of correlation sensors (Kistler Correvit) state linearity and working distance. What
it is compared with, wheel speed off a toothed disc: Gustafsson, "Rotational speed sensors:
limitations, pre-processing and automotive applications", IEEE Instrumentation and Measurement
Magazine 13 (2010).
"""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def scale(optical_speed: float, error: float) -> float:
    """Measured speed [m/s]."""
    return optical_speed * (1.0 + error)


@dataclass(frozen=True)
class OpticalScale(Effect):
    """Error of the optical sensor's scale."""

    name = "optical_scale"
    block = "optical_sensor"
    shows_in = ("optical_speed",)
    confused_with = ("radius_growth", "mounting_angle", "radius_with_lean")
    hooks = (Hook("optical_speed", scale),)

    error: float = parameter(5e-3, "1", -0.3, 0.3, "of the scale", absent=0.0, smallest=1.5e-3)

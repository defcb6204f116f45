"""Asymmetric filling: the intake empties more slowly than it fills.

Opening connects the manifold to the atmosphere, and air rushes in. Closing leaves the engine to
draw the rest out, stroke by stroke. The lag of the air is longer on the way down.

Equation
--------
    tau = tau_m (1 + a)  while the arriving throttle is below the air, else tau_m

Symbols
-------
    a       asymmetry   relative growth of the lag when closing   1   0.3 to 1 (absent 0)
    tau_m               filling time of the intake                s

Trace
-----
Opening and closing differ: even harmonics from the throttle and none from the spark; a switched
model beats a linear one.

Confused with
-------------
Loss in the driveline, which also depends on the sign of the torque: the rpm channel separates
them, since this effect is already there in the crank's acceleration.

Reference
---------
Hendricks and Sorenson, "Mean value modelling of spark ignition engines", SAE 900616 (1990);
Corno and Savaresi, SYSID 2009, for the switched model.
"""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def slower_when_closing(
    filling_time: float, arriving: float, air: float, asymmetry: float
) -> float:
    """The time constant [s] that holds at this moment."""
    return filling_time * (1.0 + asymmetry) if arriving < air else filling_time


@dataclass(frozen=True)
class AsymmetricFilling(Effect):
    """A longer lag of the air when the throttle closes."""

    name = "asymmetric_filling"
    block = "intake"
    shows_in = ("engine_speed", "rear_teeth")
    confused_with = ("driveline_loss", "fuel_film", "spark_curvature")
    hooks = (Hook("filling_time", slower_when_closing),)

    asymmetry: float = parameter(
        0.6, "1", -0.8, 5.0, "relative growth of the lag when closing", absent=0.0, smallest=0.15
    )

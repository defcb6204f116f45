"""Spark curvature: torque over spark advance is a hill, not a slope.

Burn too late and pressure comes too late; burn too early and it works against the piston. About the
best advance the torque is a parabola, so that advancing gains less than retarding loses.

Equation
--------
    T = T_0 (1 + s_1 dalpha - q dalpha^2);   the summit lies at dalpha = s_1 / (2 q)

Symbols
-------
    q        curvature   of torque over advance          1/rad^2   1.3 (4e-4 per deg^2; absent 0)
    s_1                  nominal gain of the spark       1/rad
    dalpha               spark offset                    rad

Trace
-----
Even harmonics and a loss of mean torque from spark sweeps, growing with the square of the
amplitude; none from the throttle.

Confused with
-------------
Clip of the spark (all orders, only beyond a limit): two amplitudes separate them. Asymmetric
filling: that one answers to the throttle.

Reference
---------
Heywood, "Internal Combustion Engine Fundamentals" (1988), chapter 15, on spark timing and best
torque; Guzzella and Onder (2010), chapter 2.
"""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def bend(spark_factor: float, spark: float, curvature: float) -> float:
    """The factor on the torque; it does not change its sign."""
    return max(spark_factor - curvature * spark * spark, min(spark_factor, 0.0))


@dataclass(frozen=True)
class SparkCurvature(Effect):
    """The hill of torque over spark advance."""

    name = "spark_curvature"
    block = "engine"
    shows_in = ("engine_speed", "rear_teeth")
    confused_with = ("spark_clip", "asymmetric_filling")
    hooks = (Hook("spark_factor", bend),)

    curvature: float = parameter(
        1.3, "1/rad^2", 0.0, 20.0, "of torque over advance", absent=0.0, smallest=0.3
    )

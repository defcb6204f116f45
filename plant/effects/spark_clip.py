"""Spark clip: the ECU lets the spark go only so far from its map.

Knock protection caps the advance and the exhaust's temperature caps the retard. What is asked
beyond does not happen, whatever the ECU echoes.

Equation
--------
    dalpha is taken within -a .. a

Symbols
-------
    a        limit   greatest offset that acts   rad   0.05 to 0.15 (3 to 9 deg; absent: infinite)
    dalpha           spark offset                rad

Trace
-----
Flat tops of the torque in large spark sweeps, odd harmonics, nothing in small ones.

Confused with
-------------
Spark curvature, whose harmonics are even and begin at any amplitude.

Reference
---------
Kiencke and Nielsen, "Automotive Control Systems", 2nd edition (2005), chapter on knock control.
"""

from dataclasses import dataclass
from math import inf

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def clip(spark_factor: float, spark: float, engine_spark_gain: float, limit: float) -> float:
    """The factor on the torque, of the offset within the limit."""
    return spark_factor + engine_spark_gain * (min(max(spark, -limit), limit) - spark)


@dataclass(frozen=True)
class SparkClip(Effect):
    """Greatest spark offset that acts."""

    name = "spark_clip"
    block = "engine"
    shows_in = ("engine_speed", "rear_teeth", "spark_applied")
    confused_with = ("spark_curvature",)
    hooks = (Hook("spark_factor", clip),)

    limit: float = parameter(
        0.07, "rad", 0.01, 1.0, "greatest offset that acts", absent=inf, smallest=0.14
    )

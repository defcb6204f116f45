"""Delay by crank angle: the engine acts stroke by stroke, so its delay is counted in turns.

Between the intake of a charge and its torque lie the compression and part of the power stroke. That
is an angle, not a time: at half the speed it takes twice as long.

Equation
--------
    tau = tau_a + n 2 pi / w_e,   w_e not below 30 rad/s

Symbols
-------
    n       turns   crank turns from the plate to the torque   1   1 to 2 (absent 0)
    w_e             crank speed                                rad/s
    tau_a           nominal delay of the intake                s

Trace
-----
A phase that falls with frequency, less at high engine speed.

Confused with
-------------
A fixed delay of the air box: trials at two engine speeds separate them.

Reference
---------
Guzzella and Onder, "Introduction to Modeling and Control of Internal Combustion Engine Systems",
2nd edition (2010), chapter 3, on discrete-event models: the delays that the strokes bring.
"""

import math
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def wait_for_the_stroke(air_delay: float, engine_speed: float, turns: float) -> float:
    """Total delay of the air path [s]."""
    return air_delay + turns * 2.0 * math.pi / max(engine_speed, 30.0)


@dataclass(frozen=True)
class CrankAngleDelay(Effect):
    """Dead time of so many turns of the crank."""

    name = "crank_angle_delay"
    block = "intake"
    shows_in = ("engine_speed", "rear_teeth")
    confused_with = ("air_box_delay", "channel_latency")
    hooks = (Hook("air_delay", wait_for_the_stroke),)

    turns: float = parameter(
        1.5, "1", 0.0, 6.0, "crank turns from plate to torque", absent=0.0, smallest=0.3
    )

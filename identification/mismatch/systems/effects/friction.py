"""Friction: a force that opposes the motion and does not depend on its speed.

Bearings, seals and brushes rub. Static friction is a little larger than sliding friction, and a
smaller force does not move them: they stick.

Equation
--------
    a -= min(max(a + v / h, -G), G),   G = F (1 + b exp(-(v / v_s)^2))    at the rate of the speed
    f -= G tanh(10 v / v_s)                                               elsewhere

The first is the force that stops the motion within a step h, at most G: it sticks at rest. At a
seam the other forces are not known, so motion below v_s / 10 creeps there.

Symbols
-------
    F     force       of dry friction             of the seam    0.02 to 0.5 of it (absent 0)
    b     breakaway   excess at rest              1              0 to 1
    v_s   stribeck    speed of its decay          of the speed   0.05 of the usual one
    v                 speed of the seam (`along`)
    a                 acceleration
    h                 step of integration

Trace
-----
Motion stops and starts late; slow sines become trapezes; amplitudes decay along a line.

Confused with
-------------
Dead zone (does not depend on speed), a damping (proportional to it): small and large motion.

Reference
---------
Armstrong-Helouvry, Dupont and Canudas de Wit, "A survey of models, analysis tools and compensation
methods for the control of machines with friction", Automatica 30 (1994). Sticking: Karnopp, "Computer
simulation of stick-slip friction in mechanical dynamic systems", Journal of Dynamic Systems,
Measurement, and Control 107 (1985), with a step in the place of his band of speeds.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def rub(
    value: float,
    other: float,
    rate_of: float,
    step: float,
    force: float,
    breakaway: float,
    stribeck: float,
) -> float:
    """Return the remaining force."""
    x = other / stribeck
    most = force * (1.0 + breakaway * math.exp(-x * x))
    if rate_of == other:
        return value - min(max(value + other / step, -most), most)
    return value - most * math.tanh(10.0 * x)


@dataclass(frozen=True)
class Friction(SeamEffect):
    """Dry friction with a breakaway force."""

    name = "friction"
    block = "seam"
    confused_with = ("dead_zone", "hysteresis", "asymmetry")
    acts_on = (SEAM,)
    uses = "along"
    act = rub

    force: float = parameter(0.15, "[seam]", 0.0, 3.0, "of dry friction", absent=0.0, smallest=0.03)
    breakaway: float = parameter(0.3, "1", 0.0, 3.0, "excess at rest")
    stribeck: float = parameter(0.05, "[other]", 1e-3, 1.0, "speed at which the excess is gone")

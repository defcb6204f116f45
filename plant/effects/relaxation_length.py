"""Relaxation length: the tyre has to roll before its force follows the slip.

The carcass is a spring between the rim and the tread. A change of slip first winds up this spring;
the force settles only after the tyre has rolled a certain length. At speed that length passes in
a few milliseconds, at a walking pace it takes seconds.

Equation
--------
    sigma F' / v = F_ss(slip) - F,   time constant sigma / v
    v is not taken below the tyre's low speed, nor the time constant below half a step.

Symbols
-------
    sigma   length   rolled length to 63 % of the force       m   0.1 to 0.3 (absent 0)
    F       force    force that the tyre passes on (a state)  N
    F_ss             force of the static curve                N

Trace
-----
Phase lag between slip and acceleration, and a driveline mode that loses damping; both grow as the
speed falls.

Confused with
-------------
Lag of the rpm channel, lag of the optical sensor, latency of any channel (all fixed in time): two
speeds separate them. A coarse integration step imitates a negative length.

Reference
---------
Pacejka, "Tire and Vehicle Dynamics", 3rd edition (2012), chapters 7 and 8.
"""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def relax(
    tyre_force: float, force: float, speed: float, length: float, tyre_low_speed: float, step: float
) -> tuple[float, float]:
    """The force that acts [N] and its rate [N/s]."""
    rolled = max(abs(speed), tyre_low_speed)
    rate = 2.0 / step if length * 2.0 < rolled * step else rolled / length
    acting = tyre_force if length <= 0.0 else force
    return acting, rate * (tyre_force - force)


@dataclass(frozen=True)
class RelaxationLength(Effect):
    """The force follows the slip only after the tyre has rolled a length."""

    name = "relaxation_length"
    block = "tyre"
    shows_in = ("rear_teeth", "engine_speed")
    confused_with = ("optical_lag", "channel_lag", "channel_latency")
    states = ("force",)
    starts = (700.0,)
    hooks = (Hook("tyre_force", relax, governs=("force",)),)

    length: float = parameter(0.15, "m", 0.0, 2.0, "relaxation length", absent=0.0, smallest=0.04)

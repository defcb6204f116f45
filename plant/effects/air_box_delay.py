"""Air-box delay: a longer way between the throttle and the torque than the simulation assumes.

What the throttle does has to travel through air box and runners, wait for an intake stroke, and be
burnt. All of it counts as dead time between the plate and the torque.

Equation
--------
    air(t) follows th(t - tau_a - tau)

Symbols
-------
    tau     delay   beyond the nominal delay        s   2e-3 to 10e-3 (absent 0)
    tau_a           nominal delay of the intake     s

Trace
-----
Phase that falls in proportion to frequency, with no change of gain, from the throttle and not from
the spark; the same at every engine speed.

Confused with
-------------
Delay by crank angle (shorter at high engine speed): two speeds separate them. A longer filling lag
also takes gain away. Latency of the throttle's channel: that one shifts the measured plate against
its own command as well.

Reference
---------
Corno and Savaresi, SYSID 2009: 10 ms make the fitted response minimum phase; Guzzella and Onder,
"Introduction to Modeling and Control of Internal Combustion Engine Systems", 2nd edition (2010),
chapter 2.
"""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def longer(air_delay: float, delay: float) -> float:
    """Total delay of the air path [s]."""
    return air_delay + delay


@dataclass(frozen=True)
class AirBoxDelay(Effect):
    """Dead time of the air path beyond the nominal one."""

    name = "air_box_delay"
    block = "intake"
    shows_in = ("engine_speed", "rear_teeth")
    confused_with = ("crank_angle_delay", "channel_latency")
    hooks = (Hook("air_delay", longer),)

    delay: float = parameter(
        5e-3, "s", 0.0, 0.1, "beyond the nominal delay", absent=0.0, smallest=1e-3
    )

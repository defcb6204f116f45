"""Optical lag: the speed sensor averages the road's texture before it sends a speed.

The sensor counts a grating frequency over a window and smooths it. What it reports is the speed of a
moment ago, with the corners rounded.

Equation
--------
    s' = (v - s) / tau

Symbols
-------
    tau   time_constant   lag of the sensor            s     10e-3 to 60e-3 (absent 0)
    s     seen            sensor output (a state)      m/s
    v                     true speed                   m/s

Trace
-----
Only when the speed changes: the optical speed trails the front wheel by tau times the
acceleration. Nothing at constant speed.

Confused with
-------------
Relaxation length (its lag falls as the speed rises): two speeds separate them. Latency of the
channel (a shift, no rounding): a sharp change of speed separates those.

Reference
---------
Data sheets of correlation sensors (Kistler Correvit, Datron) give their filter as a group delay.
"""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def trail(
    optical_speed: float, seen: float, time_constant: float, step: float
) -> tuple[float, float]:
    """Measured speed [m/s] and its rate [m/s^2]."""
    reading = optical_speed if time_constant <= 0.0 else seen
    return reading, (optical_speed - seen) / max(time_constant, 0.5 * step)


@dataclass(frozen=True)
class OpticalLag(Effect):
    """First-order lag of the optical speed sensor."""

    name = "optical_lag"
    block = "optical_sensor"
    shows_in = ("optical_speed",)
    confused_with = ("relaxation_length", "channel_latency", "channel_lag", "moving_average")
    states = ("seen",)
    starts = (50.0,)
    hooks = (Hook("optical_speed", trail, governs=("seen",)),)

    time_constant: float = parameter(
        20e-3, "s", 0.0, 0.5, "lag of the sensor", absent=0.0, smallest=5e-3
    )

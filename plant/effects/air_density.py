"""Air density: thin or warm air makes less torque.

The throttle meters volume; the torque needs mass. Pressure falls with height and weather, and the
air in the box warms up while the motorcycle runs, by tens of kelvins in slow traffic.

Equation
--------
    T_full *= (1 + dp) (T_0 / (T_air + dT (1 - exp(-t / tau))))^n

Symbols
-------
    dp      pressure       relative departure of the pressure   1   -0.08 to 0.03 (absent 0)
    n       exponent       of the temperature                   1   0.5 (absent 0)
    dT      warming        of the air box over a run            K   5 to 30 (absent 0)
    tau     warming_time   of the air box                       s   60
    T_air   air_temperature, an input; at rest it is T_0        K
    T_0     298.15                                              K

Trace
-----
The torque at the same throttle differs by a few per cent from day to day and sinks over a run.

Confused with
-------------
A wrong torque scale: a logged air temperature and two days separate them. Grip with temperature:
that one changes the slip, not the crank's torque.

Reference
---------
Heywood, "Internal Combustion Engine Fundamentals" (1988), chapter 2, on correction factors: full
load goes with pressure and with the root of the temperature.
"""

import math
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def thin(
    full_torque: float,
    air_temperature: float,
    time: float,
    pressure: float,
    exponent: float,
    warming: float,
    warming_time: float,
) -> float:
    """The full-load torque [N m] in this air."""
    drawn = air_temperature + warming * (1.0 - math.exp(-time / warming_time))
    return full_torque * (1.0 + pressure) * math.pow(298.15 / max(drawn, 150.0), exponent)


@dataclass(frozen=True)
class AirDensity(Effect):
    """Torque that goes with the air's pressure and temperature."""

    name = "air_density"
    block = "engine"
    shows_in = ("engine_speed", "rear_teeth", "temperatures")
    confused_with = ("grip_temperature", "fuel_film")
    hooks = (Hook("full_torque", thin),)

    pressure: float = parameter(
        -0.05, "1", -0.5, 0.2, "relative departure of the pressure", absent=0.0, smallest=-0.015
    )
    exponent: float = parameter(0.5, "1", 0.0, 1.5, "of the temperature", absent=0.0, smallest=0.15)
    warming: float = parameter(
        15.0, "K", -40.0, 80.0, "of the air box over a run", absent=0.0, smallest=5.0
    )
    warming_time: float = parameter(60.0, "s", 1.0, 3600.0, "of the air box")

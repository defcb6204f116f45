"""Fuel film: part of the injected fuel lands on the port's wall and comes later.

Injection follows the air at once, but a share of the fuel wets the wall and evaporates from there.
After opening, the mixture is lean until the film has grown; after closing it is rich.

Equation
--------
    f' = (air - f) / tau;   charge = (1 - X) air + X f

Symbols
-------
    X     share   of the fuel that meets the wall            1   0.1 to 0.4 (absent 0)
    tau   time    of evaporation                             s   0.1 to 0.3
    f     film    fuel from the film, as the opening that    1
                  would give it in steady state (a state)

Trace
-----
A slow tail after each opening and closing: the last X of the torque arrives with tau. The spark's
answer has none.

Confused with
-------------
A longer manifold lag (one lag for the whole air): a step shows two slopes here. Load transfer and
grade, slow as well: the spark's path and the crank's acceleration separate them.

Reference
---------
Aquino, "Transient A/F control characteristics of the 5 liter central fuel injection engine", SAE
810494 (1981); Hendricks and Sorenson, "SI engine controls and mean value engine modelling", SAE
910258 (1991).
"""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def wet_the_wall(charge: float, film: float, share: float, time: float) -> tuple[float, float]:
    """The charge that burns, and the rate of the film [1/s]."""
    return (1.0 - share) * charge + share * film, (charge - film) / time


@dataclass(frozen=True)
class FuelFilm(Effect):
    """Wall film of the intake port."""

    name = "fuel_film"
    block = "intake"
    shows_in = ("engine_speed", "rear_teeth")
    confused_with = ("asymmetric_filling", "air_density")
    states = ("film",)
    starts = (0.08,)
    hooks = (Hook("charge", wet_the_wall, governs=("film",)),)

    share: float = parameter(
        0.2, "1", 0.0, 0.9, "of the fuel that meets the wall", absent=0.0, smallest=0.05
    )
    time: float = parameter(0.2, "s", 0.01, 3.0, "of evaporation")

"""Squat and chain pull: the rear suspension swings when the driving force changes.

Chain pull and tyre force turn the swing arm; until the suspension has settled, the tyre is pressed
onto the road or lifted from it, with the suspension's own frequency.

Equation
--------
    y'' = w^2 (F_x - y) - 2 z w y';   F_z += g y' / w;   0 <= F_z <= m g

Symbols
-------
    g   share       load over a swing of the force        1       0.1 to 0.5 (absent 0)
    w   frequency   of the mode                           rad/s   2 pi 2 to 2 pi 4
    z   damping     of the mode                           1       0.2 to 0.4
    y   settled     force that is balanced (a state)      N
        settling    its rate (a state)                    N/s

Trace
-----
A band near 3 Hz in slip and suspension travel, with driving force as its input.

Confused with
-------------
Wind (also slow, but not tied to the input); load transfer (no resonance).

Reference
---------
Cossalter, "Motorcycle Dynamics", 2nd edition (2006), on squat and chain force; Sharp, Evangelou and
Limebeer, "Advances in the modelling of motorcycle dynamics", Multibody System Dynamics 12 (2004).
"""

import math
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def press_by_swing(
    rear_load: float, settling: float, body_mass: float, share: float, frequency: float
) -> float:
    """The load on the rear tyre [N]."""
    moved = rear_load + share * settling / frequency
    return min(max(moved, 0.0), max(rear_load, 9.80665 * body_mass))


def swing(
    tyre_force: float, settled: float, settling: float, frequency: float, damping: float
) -> tuple[float, float, float]:
    """The force [N], and rates of what has settled [N/s] and of its rate [N/s^2]."""
    push = frequency * (frequency * (tyre_force - settled) - 2.0 * damping * settling)
    return tyre_force, settling, push


@dataclass(frozen=True)
class Squat(Effect):
    """Rear load that swings with the driving force."""

    name = "squat"
    block = "tyre"
    shows_in = ("suspension_travel", "rear_teeth")
    confused_with = ("load_transfer", "wind")
    states = ("settled", "settling")
    starts = (700.0, 0.0)
    hooks = (
        Hook("rear_load", press_by_swing),
        Hook("tyre_force", swing, governs=("settled", "settling")),
    )

    share: float = parameter(
        0.3, "1", 0.0, 1.5, "load over a swing of the force", absent=0.0, smallest=0.08
    )
    frequency: float = parameter(
        2 * math.pi * 3, "rad/s", 2 * math.pi * 0.5, 2 * math.pi * 15, "frequency of the mode"
    )
    damping: float = parameter(0.3, "1", 0.05, 2.0, "damping ratio of the mode")

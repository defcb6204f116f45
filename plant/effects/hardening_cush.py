"""Hardening cush drive: the rubber blocks of the hub get stiffer the more they are squeezed.

Between sprocket and wheel sit rubber blocks. Squeezed a little they bend, squeezed a lot they only
compress. The driveline's mode climbs with load.

Equation
--------
    T = k phi (1 + beta phi^2);   phi^2 counts up to 0.04 rad^2, where the blocks are solid

Symbols
-------
    beta   hardening   growth of the stiffness with twist   1/rad^2   50 to 250 (absent 0)
    phi                twist                                rad
    k                  nominal stiffness                    N m/rad

Trace
-----
The resonance rises with the mean torque; third harmonic in large sweeps about zero.

Confused with
-------------
Backlash (soft only about zero torque): sweeps at two loads separate them. A higher stiffness
absorbs all of it at one single load. Runner resonance does not move with load.

Reference
---------
Gent (ed.), "Engineering with Rubber", 3rd edition (2012); Cossalter, "Motorcycle Dynamics", 2nd
edition (2006), on the transmission.
"""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def harden(spring_torque: float, spring_twist: float, hardening: float) -> float:
    """The elastic torque [N m]."""
    return spring_torque * (1.0 + hardening * min(spring_twist * spring_twist, 0.04))


@dataclass(frozen=True)
class HardeningCush(Effect):
    """Stiffness of the driveline that grows with twist."""

    name = "hardening_cush"
    block = "driveline"
    shows_in = ("rear_teeth", "engine_speed")
    confused_with = ("backlash", "runner_resonance")
    hooks = (Hook("spring_torque", harden),)

    hardening: float = parameter(
        150.0,
        "1/rad^2",
        0.0,
        400.0,
        "growth of the stiffness with twist",
        absent=0.0,
        smallest=30.0,
    )

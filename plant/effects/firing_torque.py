"""Firing torque: torque pulses at every power stroke, different in each cylinder.

The torque of the gas swings about its mean with the order of firing: two pushes a turn on a
four-cylinder four-stroke. Where one cylinder burns better than the others, half the crank's order
appears: once in two turns.

Equation
--------
    T += (T + T_f) (a sin(N psi / 2 + phase) + b sin(psi / 2 + phase))

Symbols
-------
    a      share      amplitude at firing order over mean torque  1     0.5 to 2 (absent 0)
    b      spread     amplitude once in two turns, over mean torque  1     0.02 to 0.1 (absent 0)
    N      cylinders  of the engine, evenly spread                 1     4
    phase  phase      where they fall                                rad   0
    psi               angle of the crank                             rad
    T_f               friction torque                                N m

Trace
-----
Lines at orders of the crank in engine speed and, through the driveline, in the wheel; they grow
with load and vanish when coasting.

Confused with
-------------
Compression torque (stays without load): a change of load separates them. Tooth misplacement and
eccentricity (orders of the wheel, not of the crank): another gear.

Reference
---------
Kiencke and Nielsen, "Automotive Control Systems", 2nd edition (2005), on torque from crank speed;
Heywood (1988), chapter 9, on cylinder-to-cylinder variation.
"""

import math
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def fire(
    engine_torque: float,
    friction_torque: float,
    crank_angle: float,
    share: float,
    spread: float,
    cylinders: float,
    phase: float,
) -> float:
    """The torque [N m] at this angle of the crank."""
    swing = share * math.sin(0.5 * cylinders * crank_angle + phase)
    swing += spread * math.sin(0.5 * crank_angle + phase)
    return engine_torque + (engine_torque + friction_torque) * swing


@dataclass(frozen=True)
class FiringTorque(Effect):
    """Swing of the gas torque with the crank's angle."""

    name = "firing_torque"
    block = "engine"
    shows_in = ("rear_teeth", "engine_speed")
    confused_with = ("compression_torque", "tooth_misplacement", "eccentricity", "chain_polygon")
    periodic = True
    unseen_turn = True
    hooks = (Hook("engine_torque", fire),)

    share: float = parameter(
        1.0, "1", 0.0, 5.0, "amplitude at firing order", absent=0.0, smallest=0.3
    )
    spread: float = parameter(
        0.05, "1", 0.0, 1.0, "amplitude once in two turns", absent=0.0, smallest=0.015
    )
    cylinders: float = parameter(4, "1", 1, 12, "power strokes in two crank turns", whole=True)
    phase: float = parameter(0.0, "rad", -math.pi, math.pi, "where they fall")

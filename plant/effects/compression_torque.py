"""Compression torque: the crank winds up the charge and the pistons' inertia and gets it back.

Compressing costs torque before top dead centre and returns it after; so does accelerating the
pistons. Neither needs any fuel: the swing is there while coasting as well.

Equation
--------
    T += A sin(N psi / 2 + phase)

Symbols
-------
    A      swing       amplitude                       N m   20 to 100 (absent 0)
    N      cylinders   of the engine, evenly spread    1     4
    phase  phase       where they fall                 rad   0
    psi                angle of the crank, 0 at top    rad

Trace
-----
A line at the order of compression in engine speed and wheel, of the same height with and without
load, falling with the square of the engine speed in the speed signal.

Confused with
-------------
Firing torque, which grows with load: a loaded sweep against a coast-down. Tooth errors: orders of
the wheel, not of the crank.

Reference
---------
Taylor, "The Internal Combustion Engine in Theory and Practice", vol. 2 (1985), on torsional
excitation; Heywood (1988), chapter 2.
"""

import math
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def compress(
    engine_torque: float, crank_angle: float, swing: float, cylinders: float, phase: float
) -> float:
    """The torque [N m] at this angle of the crank."""
    return engine_torque + swing * math.sin(0.5 * cylinders * crank_angle + phase)


@dataclass(frozen=True)
class CompressionTorque(Effect):
    """Swing of the torque that needs no fuel."""

    name = "compression_torque"
    block = "engine"
    shows_in = ("rear_teeth", "engine_speed")
    confused_with = ("firing_torque", "tooth_misplacement", "eccentricity", "chain_polygon")
    periodic = True
    unseen_turn = True
    hooks = (Hook("engine_torque", compress),)

    swing: float = parameter(40.0, "N m", 0.0, 300.0, "amplitude", absent=0.0, smallest=10.0)
    cylinders: float = parameter(4, "1", 1, 12, "compressions in two turns", whole=True)
    phase: float = parameter(0.0, "rad", -math.pi, math.pi, "where they fall")

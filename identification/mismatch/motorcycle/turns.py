"""The crank: torque lines at its orders identify the crank phase at a recording's start."""

import math

from slipbench.identification.mismatch.simulation.turn import Turn
from slipbench.plant.effects.compression_torque import CompressionTorque

SMALL = 10.0  # N m
CYLINDERS = range(1, 9)


def crank_turns() -> tuple[Turn, ...]:
    """Return lines at the firing orders of engines of one to eight cylinders."""
    return tuple(
        Turn(
            CompressionTorque(SMALL, number, 0.0),
            CompressionTorque(SMALL, number, 0.5 * math.pi),
            0.5 * number,
        )
        for number in CYLINDERS
    )

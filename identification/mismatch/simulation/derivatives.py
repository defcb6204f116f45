"""Outputs of a simulation and their derivatives with respect to the uncertain parameters."""

from dataclasses import dataclass

from slipbench.identification.mismatch.simulation.sensor import Columns


@dataclass(frozen=True)
class Derivatives:
    """out: columns of a simulation, (rows,); slopes: their derivatives, (rows, directions).

    known: indices of the coordinates of the first directions; slow: number of directions of the
    slow disturbance, which follow.
    """

    out: Columns
    slopes: Columns
    known: tuple[int, ...]
    slow: int

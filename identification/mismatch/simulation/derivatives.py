"""What a simulation did, and how all of it changes with what is uncertain."""

from dataclasses import dataclass

from slipbench.identification.mismatch.simulation.sensor import Columns


@dataclass(frozen=True)
class Derivatives:
    """out: columns of a simulation, (rows,); slopes: their derivatives, (rows, directions).

    known: numbers of the coordinates that the first directions are; slow: how many directions of
    the slow unknown follow.
    """

    out: Columns
    slopes: Columns
    known: tuple[int, ...]
    slow: int

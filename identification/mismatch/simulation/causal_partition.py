"""The chain of cause, cut at every recorded signal, as drives and blocks.

A drive is one simulation, led by recorded signals. A block is a set of outputs of one drive that
are judged together, with one noise model.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class OutputGroup:
    """subsystem: name of its simulation; outputs: sensors judged; order: of the noise model.

    memory: of the noise model, in bins.
    suspect: whether its sensors may be wrong themselves, in their clocks and in what they tell.
    """

    name: str
    subsystem: str
    outputs: tuple[str, ...]
    order: int
    suspect: bool = True
    memory: float = math.inf

    @property
    def sensors_suspected(self) -> bool:
        """Whether its outputs are places at which something may act; patterns are not."""
        return self.suspect and self.order > 0


@dataclass(frozen=True)
class CausalPartition:
    """subsystems: name -> inputs of the simulation that recorded signals lead; blocks, cause first."""

    subsystems: Mapping[str, tuple[tuple[str, str], ...]]
    groups: tuple[OutputGroup, ...]

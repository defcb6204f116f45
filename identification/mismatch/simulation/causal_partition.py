"""Partition of the causal graph at every recorded signal, into subsystems and output groups.

A subsystem is one simulation, driven by recorded signals. An output group is a set of outputs of
one subsystem that are compared with the recording together, with one noise model.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class OutputGroup:
    """subsystem: name of its simulation; outputs: its sensors; order: of the noise model.

    memory: of the noise model, in bins.
    suspect: whether its sensors may have errors of their own, in their clocks and their values.
    """

    name: str
    subsystem: str
    outputs: tuple[str, ...]
    order: int
    suspect: bool = True
    memory: float = math.inf

    @property
    def sensors_suspected(self) -> bool:
        """Whether its outputs are injection points of sensor errors; tooth patterns are not."""
        return self.suspect and self.order > 0


@dataclass(frozen=True)
class CausalPartition:
    """subsystems: name -> pairs (recorded signal, input that it drives); groups: causes first."""

    subsystems: Mapping[str, tuple[tuple[str, str], ...]]
    groups: tuple[OutputGroup, ...]

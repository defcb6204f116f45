"""Partition of the causal graph at every recorded signal, into subsystems and output groups.

A subsystem is one simulation, driven by recorded signals. An output group is a set of outputs of
one subsystem that are compared with the recording together, with one noise model.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from slipbench.identification.mismatch.simulation.record import Record

MEMORY = 1 / 3
"""Memory of the noise models, in units of `stretch`: errors farther apart correlate little."""


@dataclass(frozen=True)
class OutputGroup:
    """subsystem: name of its simulation; outputs: its sensors; order: of the noise model.

    memory: of the noise model, in bins; see `noise_memory`.
    suspect: whether its sensors may have errors of their own, in their clocks and their values.
    """

    name: str
    subsystem: str
    outputs: tuple[str, ...]
    order: int
    memory: float
    suspect: bool = True

    @property
    def sensors_suspected(self) -> bool:
        """Whether its outputs are injection points of sensor errors; tooth patterns are not."""
        return self.suspect and self.order > 0


@dataclass(frozen=True)
class CausalPartition:
    """subsystems: name -> pairs (recorded signal, input that it drives); groups: causes first."""

    subsystems: Mapping[str, tuple[tuple[str, str], ...]]
    groups: tuple[OutputGroup, ...]


def noise_memory(records: Sequence[Record]) -> float:
    """Return the memory of the noise models of these records, in bins.

    The slow disturbance explains slower errors. A noise model with a longer memory would take the
    levels of a wrong simulation for noise.
    """
    return MEMORY * min(r.grid.stretch / r.grid.width for r in records)

"""Input of one simulation of one subsystem."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from slipbench.identification.mismatch.simulation.causal_partition import CausalPartition
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.plant.signals import Floats


@dataclass(frozen=True, eq=False)
class SimulationInput:
    """What a system simulates: one subsystem of one record, with its disturbances.

    q: slow disturbance, one value for each column of `record.slow`, shape (K,). added: waveforms
    that are added to inputs of the motorcycle, or at places of a model file, by name, SI, shape
    (rows,) each.
    """

    record: Record
    partition: CausalPartition
    subsystem: str
    q: Floats
    added: Mapping[str, Floats] = field(default_factory=dict)

    @classmethod
    def undisturbed(cls, record: Record, partition: CausalPartition, subsystem: str) -> Self:
        """Return the input without slow disturbance."""
        return cls(record, partition, subsystem, np.zeros(record.slow.shape[1]))

    @property
    def drivers(self) -> tuple[tuple[str, str], ...]:
        """Pairs (recorded signal, input that it drives) of the subsystem."""
        return self.partition.subsystems[self.subsystem]

    @property
    def observed(self) -> tuple[str, ...]:
        """Sorted columns of the simulation that sensors of the subsystem measure."""
        outputs = (
            o for g in self.partition.groups if g.subsystem == self.subsystem for o in g.outputs
        )
        return tuple(sorted({c for o in outputs for c in self.record.sensors[o].observation}))

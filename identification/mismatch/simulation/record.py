"""A recording prepared for simulation."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.simulation.sampling import Grid
from slipbench.identification.mismatch.simulation.sensor import Sensor
from slipbench.plant.signals import Floats


@dataclass(frozen=True, eq=False)
class Record:
    """One prepared recording.

    start: s, bus time of row 0. inputs: (rows, k), columns as its system has them. measured: role
    -> its value at the end of each row. sensors: by name, in order. slow: (rows, K), slow
    disturbance of this record per unit of each coordinate; its system defines where it acts. notes:
    remarks for the reader of the verdict. left_out: channels not used, and why. turned: rad, angle
    at row 0 of a part whose angle is not recorded, such as a crank, as far as it was estimated.
    """

    name: str
    start: float
    grid: Grid
    inputs: Floats
    measured: Mapping[str, Floats]
    sensors: Mapping[str, Sensor]
    slow: Floats
    notes: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    turned: float = 0.0

    @property
    def time(self) -> Floats:
        """End of each row, s since the start."""
        return np.asarray(self.grid.step * np.arange(1, self.grid.rows + 1))

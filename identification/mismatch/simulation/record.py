"""A recording made ready to be simulated again."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.simulation.sampling import Grid
from slipbench.identification.mismatch.simulation.sensor import Sensor
from slipbench.plant.signals import Floats


@dataclass(frozen=True, eq=False)
class Record:
    """One recording, ready.

    start: s, bus time of row 0. inputs: (rows, k), columns as its system has them. measured: role
    -> its value at the end of each row. sensors: by name, in order. slow: (rows, K), what may act
    unknown and slowly on this record, per unit of each coordinate; its system knows on what. notes:
    what a reader of the verdict must know of it. left_out: channels of no use, and why. turned:
    rad, where what turns unseen, such as a crank, stood at row 0, as far as it was read off.
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

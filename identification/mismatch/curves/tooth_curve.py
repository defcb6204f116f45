"""What repeats with the recorded angle of a wheel, without the library: a value for each tooth."""

from collections.abc import Iterator

import numpy as np

from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.model import Series
from slipbench.identification.mismatch.simulation.regressor import evenly_round
from slipbench.plant.signals import Floats

SIZE = 1e-3  # of the relative speed
COUNTS = 0.5
"""Discs are cut to some hundredths of a millimetre; half of a run-out of 1e-3 is beyond that."""


def discs(fit: Fit) -> Iterator[tuple[InjectionPoint, Floats]]:
    """Yield every toothed wheel as a place, with the angles of its teeth (rad)."""
    for block in fit.model.partition.groups:
        for output in block.outputs:
            late = fit.model.records[0].sensors[output].offsets
            if not block.order and late is not None:
                wheel = output.split("_")[0]
                place = InjectionPoint(
                    f"{wheel} teeth",
                    f"{wheel}_encoder",
                    "1",
                    SIZE,
                    block.subsystem,
                    negligible=COUNTS,
                )
                yield place, evenly_round(late.shape[1])


def tooth_columns(fit: Fit, place: InjectionPoint) -> Series:
    """Answer of the pattern's rows to the value of each tooth, (T, 1, teeth)."""
    found: Series = [[np.empty(0)] * len(fit.model.records) for _ in fit.model.partition.groups]
    for b, block in enumerate(fit.model.partition.groups):
        if not block.order and block.name == place.block.replace("_", " "):
            for r, rows in enumerate(fit.model.measured[b]):
                late = fit.model.records[r].sensors[block.outputs[0]].offsets
                assert late is not None
                eye = np.eye(late.shape[1]) * SIZE
                found[b][r] = np.tile(eye, (len(rows) // len(eye), 1))[:, None, :]
    return found

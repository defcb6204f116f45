"""Tooth pattern of a wheel as a free curve of its angle: one value per tooth."""

from collections.abc import Iterator

import numpy as np

from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.model import Series
from slipbench.identification.mismatch.simulation.regressor import even_angles
from slipbench.plant.signals import Floats

SIZE = 1e-3  # of the relative speed
COUNTS = 0.5
"""Smallest amplitude of interest, relative to SIZE: discs are cut to some hundredths of a mm."""


def discs(fit: Fit) -> Iterator[tuple[InjectionPoint, Floats]]:
    """Yield every toothed wheel as an injection point, with the angles of its teeth, rad."""
    for block in fit.model.partition.groups:
        for output in block.outputs:
            offsets = fit.model.records[0].sensors[output].offsets
            if not block.order and offsets is not None:
                wheel = output.split("_")[0]
                place = InjectionPoint(
                    f"{wheel} teeth",
                    f"{wheel}_encoder",
                    "1",
                    SIZE,
                    block.subsystem,
                    negligible=COUNTS,
                )
                yield place, even_angles(offsets.shape[1])


def tooth_columns(fit: Fit, place: InjectionPoint) -> Series:
    """Return the responses of tooth-pattern outputs to the value of each tooth, (T, 1, teeth)."""
    responses: Series = [[np.empty(0)] * len(fit.model.records) for _ in fit.model.partition.groups]
    for b, block in enumerate(fit.model.partition.groups):
        if not block.order and block.name == place.block.replace("_", " "):
            for r, rows in enumerate(fit.model.measured[b]):
                offsets = fit.model.records[r].sensors[block.outputs[0]].offsets
                assert offsets is not None
                eye = np.eye(offsets.shape[1]) * SIZE
                responses[b][r] = np.tile(eye, (len(rows) // len(eye), 1))[:, None, :]
    return responses

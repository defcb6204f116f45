"""Recordings as their sensors would have recorded a simulation.

The inputs stay as they were recorded, and so do the instants of the samples, latencies, clocks and
steps of every channel. Only what the outputs recorded is replaced.
"""

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.simulation.model import (
    Model,
    Point,
    Runs,
    Series,
    lateness,
    predict,
)
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sensor import Columns, Sensor
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats


def replicated(model: Model, point: Point, noise: Series, like: Iterable[Record]) -> list[Record]:
    """Records whose outputs are those of a point with noise added.

    noise: (T, m) by block and record, one value a bin. like: the records to copy, in the order of
    the model's. Raises PlantError where the point cannot be simulated.
    """
    runs: Runs = {}
    shown = predict(model, point, runs=runs)
    effects = model.at(point).effects
    found = []
    for r, record in enumerate(like):
        sensors = dict(record.sensors)
        for b, block in enumerate(model.partition.groups):
            late, out = lateness(model, point, block), runs[r, block.subsystem]
            for j, name in enumerate(block.outputs):
                own = noise[b][r][:, j]
                sensor = sensors[name]
                if sensor.time is None:
                    sensors[name] = replace(sensor, value=shown[b][r][:, j] + own)
                else:
                    behind = late.get(sensor.clock, 0.0)
                    sensors[name] = _recorded(sensor, out, effects, behind, own)
        found.append(replace(record, sensors=sensors, turned=0.0))
    return found


def _recorded(
    sensor: Sensor, out: Columns, effects: Iterable[Effect], late: float, noise: Floats
) -> Sensor:
    """Return a point sensor with the samples that it would have recorded."""
    assert sensor.time is not None
    number = np.floor((sensor.time - sensor.grid.start) / sensor.grid.width).astype(int)
    by_sample = _without_rounding(sensor, noise)[np.clip(number, 0, noise.size - 1)]
    return sensor.recording(sensor.samples(out, effects, late, by_sample))


def _without_rounding(sensor: Sensor, noise: Floats) -> Floats:
    """Return noise less the share that rounding adds again: residuals contain it already."""
    step, spread = sensor.quantization.step, float(np.var(np.diff(noise))) / 2.0
    if sensor.coarse or step <= 0.0 or spread <= 0.0:
        return noise
    assert sensor.time is not None
    a_bin = max(sensor.time.size * sensor.grid.width / np.ptp(sensor.time), 1.0)
    of_rounding = step**2 / 12.0 / a_bin
    return noise * math.sqrt(max(1.0 - of_rounding / spread, 0.0))

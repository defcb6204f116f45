"""Replicated recordings: what the sensors would have recorded of a simulation.

The inputs stay as recorded, and so do the sample times, latencies, clocks and quantization of every
channel. Only the recorded outputs are replaced.
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
    clock_offsets,
    predict,
)
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sensor import Columns, Sensor
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats


def replicated(model: Model, point: Point, noise: Series, like: Iterable[Record]) -> list[Record]:
    """Return records whose outputs are those of a point with noise added.

    noise: (T, m) by output group and record, one value a bin. like: the records to copy, in the
    order of the model's. Raises PlantError where the point cannot be simulated.
    """
    runs: Runs = {}
    predicted = predict(model, point, runs=runs)
    effects = model.at(point).effects
    replicas = []
    for r, record in enumerate(like):
        sensors = dict(record.sensors)
        for b, group in enumerate(model.partition.groups):
            offsets, out = clock_offsets(model, point, group), runs[r, group.subsystem]
            for j, name in enumerate(group.outputs):
                added = noise[b][r][:, j]
                sensor = sensors[name]
                if sensor.time is None:
                    sensors[name] = replace(sensor, value=predicted[b][r][:, j] + added)
                else:
                    late = offsets.get(sensor.clock, 0.0)
                    sensors[name] = _recorded(sensor, out, effects, late, added)
        replicas.append(replace(record, sensors=sensors, turned=0.0))
    return replicas


def _recorded(
    sensor: Sensor, out: Columns, effects: Iterable[Effect], late: float, noise: Floats
) -> Sensor:
    """Return a point sensor with samples of the simulation. noise: one value a bin."""
    assert sensor.time is not None
    bins = np.floor((sensor.time - sensor.grid.start) / sensor.grid.width).astype(int)
    sample_noise = _without_rounding(sensor, noise)[np.clip(bins, 0, noise.size - 1)]
    return sensor.recording(sensor.samples(out, effects, late, sample_noise))


def _without_rounding(sensor: Sensor, noise: Floats) -> Floats:
    """Return noise scaled down by the variance of rounding, which the samples receive again."""
    step, variance = sensor.quantization.step, float(np.var(np.diff(noise))) / 2.0
    if sensor.coarse or step <= 0.0 or variance <= 0.0:
        return noise
    assert sensor.time is not None
    samples_per_bin = max(sensor.time.size * sensor.grid.width / np.ptp(sensor.time), 1.0)
    rounding_variance = step**2 / 12.0 / samples_per_bin
    return noise * math.sqrt(max(1.0 - rounding_variance / variance, 0.0))

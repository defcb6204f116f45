"""Surrogate recordings in which nothing is missing, with the inputs and disturbances of real ones.

An improved model is simulated with the inputs of a recording. The residual of the recording is added with
random phases (Theiler et al., "Testing for nonlinearity in time series: the method of surrogate
data", Physica D 58, 1992): it keeps its size and spectrum, and loses what the model could explain.
"""

from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.fit.calibrate import start_fit
from slipbench.identification.mismatch.fit.held_out import simulated_only
from slipbench.identification.mismatch.simulation.model import models
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.identification.mismatch.systems.system import DRIVE, ModelSystem
from slipbench.plant.signals import Floats
from slipbench.protocol.recording.recording import Recording


def surrogate(system: ModelSystem, recording: Recording, seed: int) -> Recording:
    """Copy of a recording whose outputs the system has produced.

    Slow unknowns (initial values, drifts) are those that fit the recording best.
    """
    rng = np.random.default_rng(seed)
    record = system.prepare(recording)
    model = models(system, [record])[0]
    slow = simulated_only(model, system, start_fit(model, model.origin())).point.q[0]
    simulated = system.simulate(SimulationInput(record, model.partition, DRIVE, slow))
    channels = dict(recording.channels)
    for name in record.sensors:
        output = system.file.outputs[name]
        measured = channels[output.role]
        time = measured.time - output.latency - record.start
        value = np.interp(time, record.time, simulated[name])
        residual = random_phases(measured.value - value, rng)
        channels[output.role] = replace(measured, value=value + residual)
    return replace(recording, channels=channels)


def random_phases(series: Floats, rng: np.random.Generator) -> Floats:
    """Series with the amplitude spectrum of another, shape (n,), and random phases; NaN stays NaN."""
    known = np.isfinite(series)
    spectrum = np.fft.rfft(series[known] - np.mean(series[known]))
    rotated = np.abs(spectrum) * np.exp(2j * np.pi * rng.random(spectrum.size))
    result = np.full(series.shape, np.nan)
    result[known] = np.fft.irfft(rotated, int(known.sum()))
    return result

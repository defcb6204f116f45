"""A control: recordings of a system in which nothing is missing, driven and disturbed as the real.

An improved file is simulated as a recording drove it, and what that leaves of the recording is
added with its phases drawn anew (Theiler et al., "Testing for nonlinearity in time series: the
method of surrogate data", Physica D 58, 1992): as large and as coloured as it was, but of nothing
that the recording tells.
"""

from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.fit.calibrate import as_told
from slipbench.identification.mismatch.fit.held_out import driven
from slipbench.identification.mismatch.simulation.model import models
from slipbench.identification.mismatch.systems.system import DRIVE, ModelSystem
from slipbench.plant.signals import Floats
from slipbench.protocol.recording.recording import Recording


def twin(system: ModelSystem, recording: Recording, seed: int) -> Recording:
    """Return the recording with outputs as the system would have told them.

    What is slow and unknown (first values, drifts) is what fits the recording best.
    """
    rng = np.random.default_rng(seed)
    record = system.prepare(recording)
    model = models(system, [record])[0]
    slow = driven(model, system, as_told(model, model.origin())).point.q[0]
    shown = system.simulate(record, model.chain, DRIVE, slow, {})
    channels = dict(recording.channels)
    for name in record.sensors:
        output = system.file.outputs[name]
        told = channels[output.role]
        made = np.interp(told.time - output.latency - record.start, record.time, shown[name])
        channels[output.role] = replace(told, value=made + scrambled(told.value - made, rng))
    return replace(recording, channels=channels)


def scrambled(left: Floats, rng: np.random.Generator) -> Floats:
    """Return a series with the spectrum of another and phases of its own; NaN where it was NaN."""
    known = np.isfinite(left)
    lines = np.fft.rfft(left[known] - np.mean(left[known]))
    turned = np.abs(lines) * np.exp(2j * np.pi * rng.random(lines.size))
    found = np.full(left.shape, np.nan)
    found[known] = np.fft.irfft(turned, int(known.sum()))
    return found

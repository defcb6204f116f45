"""Simulation error on a test, of which only the first samples may set the initial state."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import optimize

from slipbench.identification.mismatch.simulation.quantization import NO_GRID
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.identification.mismatch.simulation.system import System
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats
from slipbench.protocol.recording.recording import Recording

WILD = 1e3
"""Of the noise: error of a start from which the simulation grows without bound."""
SHORTEST = 60
"""Samples of the shortest recording that can be simulated."""
STARTS = (0.0, 1.0, -1.0)
"""Prior deviations of the initial state from which it is fitted."""


@dataclass(frozen=True)
class TestError:
    """rms: SI, over so many samples, the first ones left out."""

    rms: float
    samples: int


def error_on(system: System, recording: Recording, first: int, noise: float) -> TestError:
    """Error of the only output of a recording. first: samples that set the initial state.

    noise: deviation of the residuals, SI, against which the prior of the initial state counts.
    """
    record = system.prepare(recording)
    begin = system.prepare(_first_part(recording, max(first, SHORTEST)))
    shown, measured = _simulate(system, record, _initial_state(system, begin, first, noise))
    rest = (measured - shown)[first:]
    return TestError(float(np.sqrt(np.mean(rest**2))), rest.size)


def _first_part(recording: Recording, samples: int) -> Recording:
    """Return the first samples of every channel: what the initial state is estimated with."""
    channels = {
        role: replace(c, time=c.time[:samples], value=c.value[:samples])
        for role, c in recording.channels.items()
    }
    return replace(recording, channels=channels)


def _initial_state(system: System, record: Record, first: int, noise: float) -> Floats:
    size = record.slow.shape[1]

    def rest(q: Floats) -> Floats:
        try:
            shown, measured = _simulate(system, record, q)
        except PlantError:
            return np.full(first + size, WILD)
        return np.concatenate(((measured - shown)[:first] / noise, q))

    starts = [np.full(size, s) for s in STARTS]
    fits = [optimize.least_squares(rest, q, diff_step=1e-3, max_nfev=30) for q in starts]
    return np.asarray(min(fits, key=lambda fit: float(fit.cost)).x)


def _simulate(system: System, record: Record, q: Floats) -> tuple[Floats, Floats]:
    """Return what the simulation shows at the samples of the record, and what they are, SI."""
    partition = system.partition([record])
    [block] = partition.groups
    sensor = replace(record.sensors[block.outputs[0]], quantization=NO_GRID)
    assert sensor.time is not None
    assert sensor.samples_read is not None
    out = system.simulate(SimulationInput(record, partition, block.subsystem, q))
    shown = sensor.samples(out, system.effects, 0.0, np.zeros(sensor.time.size))
    within = sensor.time <= record.grid.step * record.grid.rows
    return shown[within], sensor.samples_read[within]

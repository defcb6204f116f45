"""Impulse response of all outputs to an input disturbance at an injection point.

The impulse is a disturbance, for example a force or torque, of one time bin, at one time of each
recording. The response of the fitted simulation, convolved with the waveform of a disturbance, is
its linear effect on the outputs. It is accurate to some per cent, which is sufficient to locate a
mismatch and its regressor.
"""

from collections.abc import Mapping

import numpy as np
from scipy import signal

from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.model import Runs, Series, simulate
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sensor import Columns
from slipbench.identification.mismatch.simulation.system import System
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

IMPULSE_TIME = 5 / 6
"""Time of the impulse after the start of the simulation, relative to the segment length."""


def places(fit: Fit) -> list[InjectionPoint]:
    """Return the injection points observable in these recordings, without sensors."""
    return fit.model.system.places(fit.model.partition)


def simulated_impulse_responses(fit: Fit, place: InjectionPoint, plain: Runs) -> Series:
    """Return the responses of all outputs to an impulse of one bin, by output group and record.

    Each is (memory, m), or empty where unaffected. plain: cached simulations without impulse; new
    ones are added.
    """
    model = fit.model
    responses: Series = [[np.empty(0)] * len(model.records) for _ in model.partition.groups]
    for r in range(len(model.records)):
        for b, one in _impulse_response(fit, place, r, plain).items():
            responses[b][r] = one
    return responses


def _impulse_response(fit: Fit, place: InjectionPoint, r: int, plain: Runs) -> dict[int, Floats]:
    model = fit.model
    grid = model.records[r].grid
    warm_up_bins = round(grid.start / grid.width)
    first = round((grid.start + IMPULSE_TIME * grid.stretch) / grid.width)
    pulse = np.zeros(grid.rows)
    rows_per_bin = grid.rows_per_bin
    pulse[first * rows_per_bin : (first + 1) * rows_per_bin] = place.size
    if (r, place.subsystem) not in plain:
        plain[r, place.subsystem] = simulate(
            model, fit.point, r, place.subsystem, {}, model.at(fit.point)
        )
    size = place.size
    try:
        disturbed = _with_impulse(fit, place, r, pulse)
    except PlantError:  # outside the range that the simulation accepts: reverse the sign
        size, disturbed = -size, _with_impulse(fit, place, r, -pulse)
    skip, length = first - warm_up_bins, round(grid.stretch / grid.width)
    return {
        b: _observed_change(fit, b, r, disturbed, plain[r, place.subsystem])[skip : skip + length]
        / size
        for b, block in enumerate(model.partition.groups)
        if block.subsystem == place.subsystem and block.order
    }


def disturbance(
    system: System, place: InjectionPoint, record: Record, waveform: Floats
) -> Mapping[str, Floats]:
    """Return a disturbance at an injection point, see `InputDisturbance`; an error of a sensor too.

    waveform: in the unit of the injection point, SI, shape (rows,).
    """
    if place.inputs:
        return system.input_disturbance(place, record, waveform)
    return {place.name: waveform}


def _with_impulse(fit: Fit, place: InjectionPoint, r: int, pulse: Floats) -> Columns:
    system = fit.model.at(fit.point)
    injected = system.input_disturbance(place, fit.model.records[r], pulse)
    return simulate(fit.model, fit.point, r, place.subsystem, injected, system)


def _observed_change(fit: Fit, b: int, r: int, disturbed: Columns, plain: Columns) -> Floats:
    record, block = fit.model.records[r], fit.model.partition.groups[b]
    sensors = [record.sensors[o] for o in block.outputs]
    return np.column_stack([s.observe(disturbed) - s.observe(plain) for s in sensors])


def respond(impulse_response: Floats, waveforms: Floats) -> Floats:
    """Return the responses (T, m, k) to disturbance waveforms (T, k), one value per bin."""
    full = signal.fftconvolve(waveforms[:, None, :], impulse_response[:, :, None], axes=0)
    return np.asarray(full[: len(waveforms)])

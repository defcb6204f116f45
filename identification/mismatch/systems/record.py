"""Prepare a recording for the system of a model file: inputs by row, and sensors.

Residuals are tested in bins of the model file's period; the length of a row follows from the
sampling interval of the fastest input. The time of a row is its end.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import interpolate, signal

from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sampling import Grid
from slipbench.identification.mismatch.simulation.sensor import (
    Columns,
    Sampled,
    Sensor,
    point_sensor,
)
from slipbench.identification.mismatch.systems.clock_search import best_shift
from slipbench.identification.mismatch.systems.input_noise import WIDTHS, noise_of, smoothings
from slipbench.identification.mismatch.systems.model_file import (
    DrivenInput,
    Input,
    ModelFile,
    Output,
    State,
)
from slipbench.identification.mismatch.systems.recording_check import (
    coarse_inputs,
    sparse_outputs,
    usable,
    window,
)
from slipbench.identification.signals.aligned import Aligned, aligned
from slipbench.identification.signals.clocks import BUS
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.recording import Recording

Integers = NDArray[np.intp]
LEAST = 30  # bins
STRETCH = 30  # bins, where the file states none
FINER = 4
"""Rows per sample of a smooth input, which is curved between samples."""
MOST_ROWS = 2_000_000
MOST_FINE_ROWS = 200_000
"""Largest number of rows of one integration step each, for samples that lie within rows."""
WITHIN = 0.02
"""Share of a row: a sample farther than this from its begin and its end lies within it."""
LEAST_CORRELATION = 0.7
"""Least correlation at which a clock may be aligned: half of the variance is common."""
SLACK = 1e-3
"""Share of a row: a sample this close to its begin or end counts as simultaneous with it."""
SPREAD_AT_FIRST = 0.5
"""Prior deviation of a state's unknown initial value, in its usual magnitude."""


def prepare(recording: Recording, file: ModelFile) -> Record:
    """Prepare a recording. Raises InputError where an input or every output is missing."""
    data = aligned(usable(recording, file))
    _check_inputs(data, file)
    recorded = [
        n for n, o in file.outputs.items() if data.has(o.role) or _on_own_clock(data, o.role)
    ]
    if not recorded:
        raise InputError(
            "no output of the model file was recorded",
            where=str(recording.folder),
            expected=", ".join(o.role for o in file.outputs.values()),
            found="; ".join(f"{r}: {w}" for r, w in data.absent.items())
            or ", ".join(data.time)
            or "no channels",
            remedy="check the role map and the sensors",
        )
    _check_starts(file, recorded, str(recording.folder))
    start, end, notes = window(data, file, _coverage_times(data, file, recorded))
    grid = _grid(data, file, start, end, recorded)
    time: Floats = np.asarray(start + grid.step * np.arange(1, grid.rows + 1), np.float64)
    inputs = np.empty((grid.rows, len(file.inputs)))
    for k, name in enumerate(file.inputs):
        inputs[:, k] = _input_rows(data, file, name, time, grid.step)
    sensors = {name: _output_sensor(data, file, name, start, grid) for name in recorded}
    measured = {name: _interpolated(data, file.outputs[name].role, 0.0, time) for name in recorded}
    slow = np.column_stack((_slow_columns(file, grid), *_input_noise(data, file, inputs, grid)))
    left_out = tuple(
        f"{o.role}: {data.absent[o.role]}"
        for n, o in file.outputs.items()
        if n not in recorded and o.role in data.absent
    )
    name = recording.folder.name
    notes = (*notes, *sparse_outputs(data, file, recorded), *coarse_inputs(data, file))
    return Record(name, start, grid, inputs, measured, sensors, slow, notes, left_out)


def _coverage_times(data: Aligned, file: ModelFile, recorded: list[str]) -> list[Floats]:
    """Return times of the inputs, else of the outputs, on the bus clock if any are, s."""
    inputs = [entry.role for entry in file.inputs.values()]
    roles = inputs or [file.outputs[name].role for name in recorded]
    on_bus = [role for role in roles if data.has(role)]
    return [_times(data, role) for role in on_bus or roles]


def _check_starts(file: ModelFile, recorded: list[str], where: str) -> None:
    """Raise InputError where a state starts from an output that was not recorded."""
    for name, state in file.states.items():
        if isinstance(state.start, str) and state.start not in recorded:
            raise InputError(
                f"the state {name!r} starts from an output that was not recorded",
                where=where,
                expected=f"the role {file.outputs[state.start].role!r} of output {state.start!r}",
                found=f"outputs {', '.join(recorded)}",
                remedy="give states." + name + ".start a value in the model file",
            )


def realigned(record: Record, recording: Recording, file: ModelFile, simulated: Columns) -> Record:
    """Align channels on unrelated clocks with the recording's clock, by simulated outputs.

    The offset of each clock maximizes the correlation of the channel with its simulation. Raises
    InputError where no output can be aligned.
    """
    data, sensors = aligned(recording), dict(record.sensors)
    notes, left_out = list(record.notes), list(record.left_out)
    for name in record.sensors:
        role = file.outputs[name].role
        if _on_own_clock(data, role):
            channel = recording.channels[role]
            start, correlation = best_shift(
                record.grid.step, simulated[name], channel.time, channel.value
            )
            if abs(correlation) < LEAST_CORRELATION:
                left_out.append(
                    f"{role}: its clock {channel.clock!r} cannot be aligned: no channel is on both"
                    f" clocks, and the correlation with the simulation is at most {abs(correlation):.2f}"
                )
                del sensors[name]
                continue
            sensors[name] = _output_sensor(data, file, name, start, record.grid)
            notes.append(
                f"the clock {channel.clock!r} of {name.replace('_', ' ')} is"
                f" {start - record.start:.3f} s ahead of the recording's: at this offset its"
                f" correlation with the simulation is {correlation:.4f}"
            )
    if not sensors:
        raise InputError(
            "no output of the model file can be aligned with the simulation",
            where=str(recording.folder),
            found="; ".join(left_out),
            remedy="record a channel of each clock on both, or check the model file",
        )
    return replace(record, sensors=sensors, notes=tuple(notes), left_out=tuple(left_out))


def _check_inputs(data: Aligned, file: ModelFile) -> None:
    for name, entry in file.inputs.items():
        if not data.has(entry.role):
            raise InputError(
                f"the input {name!r} was not recorded",
                where=str(data.recording.folder),
                expected=f"the role {entry.role}",
                found=data.absent.get(entry.role, ", ".join(data.time)),
                remedy="check the role map, or use a recorded signal as the input of the model file",
            )


def _period(time: Floats) -> float:
    """Return the mean sampling interval, s."""
    return float((time[-1] - time[0]) / max(time.size - 1, 1))


def _grid(data: Aligned, file: ModelFile, start: float, end: float, recorded: list[str]) -> Grid:
    """Return rows of the fastest input's sampling interval, or of a step where samples lie within.

    Without inputs a row is as long as a bin, or as a step of integration.
    """
    width, length = file.period, end - start
    intervals = (
        _period(data.time[i.role]) / (FINER if i.smooth else 1) for i in file.inputs.values()
    )
    interval = min(intervals, default=width)
    rows_per_bin = max(1, round(width / min(interval, width)))
    fine_rows_per_bin = max(rows_per_bin, math.ceil(width / file.step - 1e-9))
    if length * fine_rows_per_bin / width <= MOST_FINE_ROWS and _samples_within_rows(
        data, file, start, width / rows_per_bin, recorded
    ):
        rows_per_bin = fine_rows_per_bin
    step = width / rows_per_bin
    rows = int(length / step + 1e-6)
    bins = (rows - 2 * rows_per_bin) // rows_per_bin
    if bins < LEAST or rows > MOST_ROWS:
        raise InputError(
            "the recording is too short" if bins < LEAST else "the recording is too long",
            where=str(data.recording.folder),
            expected=f"{LEAST} bins of {width:.3g} s up to {MOST_ROWS} rows",
            found=f"{length:.3g} s in rows of {step:.3g} s",
            remedy="give a longer segment" if bins < LEAST else "give a segment, as in run@0:60",
        )
    # Shifted by a quarter of a bin from the instants of regular samples: one sample in each bin.
    segment = min(file.stretch or STRETCH * width, bins * width)
    return Grid(rows, 1.25 * width, int(bins), width, step, segment)


def _samples_within_rows(
    data: Aligned, file: ModelFile, start: float, step: float, recorded: list[str]
) -> bool:
    """Return whether samples of inputs or outputs lie within rows, where they are interpolated.

    Rows of one integration step need no further integration, except in an outside simulation.
    """
    if any(isinstance(entry, DrivenInput) for entry in file.inputs.values()):
        return False
    outputs = (file.outputs[name] for name in recorded)
    channels: list[Input | Output] = [*file.inputs.values(), *outputs]
    for entry in channels:
        if data.has(entry.role) and not (isinstance(entry, Input) and entry.slope_over > 0.0):
            position = (data.time[entry.role] - entry.latency - start) / step
            if np.abs(position - np.round(position)).max() > WITHIN:
                return True
    return False


def _interpolated(data: Aligned, role: str, latency: float, time: Floats) -> Floats:
    """Return values by linear interpolation between samples, (rows,)."""
    channel = data.recording.channels[role]
    sampled = _times(data, role)
    keep = np.isfinite(channel.value) & np.isfinite(sampled)
    return np.interp(time, sampled[keep] - latency, channel.value[keep])


def _on_own_clock(data: Aligned, role: str) -> bool:
    """Return whether a channel's clock is unrelated to the bus clock."""
    channel = data.recording.channels.get(role)
    return channel is not None and channel.clock != BUS and channel.arrival is None


def _times(data: Aligned, role: str) -> Floats:
    """Return times of a channel on the bus clock, or on its own where that cannot be aligned, s."""
    return data.time[role] if data.has(role) else data.recording.channels[role].time


def _input_rows(data: Aligned, file: ModelFile, name: str, time: Floats, step: float) -> Floats:
    """Return an input, (rows,): the mean over the row if held, else the value at its end."""
    entry = file.inputs[name]
    if entry.slope_over > 0.0:
        return _slope(_interpolated(data, entry.role, entry.latency, time), entry.slope_over, step)
    channel = data.recording.channels[entry.role]
    sampled = data.time[entry.role] - entry.latency
    keep = np.isfinite(channel.value) & np.isfinite(sampled)
    if entry.smooth:
        return np.asarray(interpolate.CubicSpline(sampled[keep], channel.value[keep])(time))
    if not entry.held:
        return _interpolated(data, entry.role, entry.latency, time)
    values = np.asarray(channel.value[keep], np.float64)
    if isinstance(entry, DrivenInput) and entry.exact:
        return values[_last_sample(sampled[keep], time - step, SLACK * step)]
    return _held(sampled[keep], values, time, step)


def _held(sampled: Floats, values: Floats, time: Floats, step: float) -> Floats:
    """Return the mean of the zero-order hold over each row: a sample acts from its own time on.

    With the value at a row's begin it would act up to a row later, which is a dead time of half a
    row on average. sampled, values: (n,); time: s, of the rows' ends.
    """
    integral = np.concatenate(([0.0], np.cumsum(values[:-1] * np.diff(sampled))))

    def area(t: Floats) -> Floats:
        k = _last_sample(sampled, t, 0.0)
        return np.asarray(integral[k] + values[k] * (t - sampled[k]))

    at_begin = _last_sample(sampled, time - step, SLACK * step)
    at_end = _last_sample(sampled, time, -SLACK * step)
    mean = (area(time) - area(time - step)) / step
    return np.where(at_end > at_begin, mean, values[at_begin])


def _last_sample(sampled: Floats, time: Floats, slack: float) -> Integers:
    """Return the index of the last sample up to each time plus slack; 0 before all samples."""
    index = np.searchsorted(sampled, time + slack, side="right") - 1
    return np.clip(index, 0, len(sampled) - 1)


def _slope(values: Floats, span: float, step: float) -> Floats:
    """Return the least-squares slope over a span centred at each row, (rows,): without delay."""
    rows = max(3, 2 * round(0.5 * span / step) + 1)
    if rows >= values.size:
        return np.gradient(values, step)
    slope: Floats = signal.savgol_filter(values, rows, 1, deriv=1, delta=step)
    return slope


def _output_sensor(data: Aligned, file: ModelFile, name: str, start: float, grid: Grid) -> Sensor:
    entry = file.outputs[name]
    channel = data.recording.channels[entry.role]
    time = _times(data, entry.role) - entry.latency - start
    keep = np.isfinite(channel.value) & np.isfinite(time)
    samples = Sampled(time[keep], channel.value[keep], channel.clock)
    noise = entry.noise.si
    return point_sensor(name, entry.size.si_unit, name, 1.0, samples, grid, noise)


def _slow_columns(file: ModelFile, grid: Grid) -> Floats:
    """Return disturbances of the rates of states, (rows, columns).

    An initial impulse each, then a tent basis where the file states a drift. Columns in the order of `slow_places`.
    """
    first = np.zeros((grid.rows, len(file.states)))
    first[:1] = [_initial_deviation(state) / grid.step for state in file.states.values()]
    tents = [
        _tent_basis(grid, state.every or grid.stretch).T * state.drift.si
        for state in file.states.values()
        if state.drift is not None
    ]
    return np.concatenate((first, *tents), axis=1)


def first_of(state: str, file: ModelFile) -> tuple[int, float] | None:
    """Return the column of a state's initial value and the change per unit, SI; None: no state."""
    names = [*file.states]
    return (names.index(state), _initial_deviation(file.states[state])) if state else None


def _initial_deviation(state: State) -> float:
    return SPREAD_AT_FIRST * state.size.si if state.first is None else state.first.si


def _tent_basis(grid: Grid, every: float) -> Floats:
    time = grid.step * (np.arange(grid.rows) + 0.5)
    knots = np.linspace(0.0, time[-1], max(int(time[-1] / every), 1) + 1)
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(time - knots[:, None]) / (knots[1] - knots[0])))


def _input_noise(data: Aligned, file: ModelFile, inputs: Floats, grid: Grid) -> list[Floats]:
    """Return the symmetric filters of the inputs that may contain noise, (rows,) each."""
    columns = []
    for values, entry in zip(inputs.T, file.inputs.values(), strict=True):
        if entry.noisy:
            rows = _period(data.time[entry.role]) / grid.step
            samples = values[:: max(round(rows), 1)]
            noise = noise_of(samples) if entry.noise is None else entry.noise.si
            columns += smoothings(values, rows, noise)
    return columns


def slow_places(file: ModelFile, grid: Grid) -> list[int]:
    """Return the kernel's index of the place at which each slow column acts."""
    rates = range(
        len(file.inputs) + len(file.seams), len(file.states) + len(file.inputs) + len(file.seams)
    )
    places = [*rates]
    for k, state in zip(rates, file.states.values(), strict=True):
        if state.drift is not None:
            places += [k] * len(_tent_basis(grid, state.every or grid.stretch))
    noisy = [k for k, entry in enumerate(file.inputs.values()) if entry.noisy]
    return places + [k for k in noisy for _ in WIDTHS]

"""A recording made ready for the system of a model file: inputs row by row, and sensors.

Residuals are judged in bins of the model file's period; rows are as long as the fastest input's
period allows. A row tells its own end.
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
from slipbench.identification.mismatch.systems.fitness import (
    coarse_inputs,
    sparse_outputs,
    usable,
    window,
)
from slipbench.identification.mismatch.systems.input_noise import WIDTHS, noise_of, smoothings
from slipbench.identification.mismatch.systems.model_file import (
    DrivenInput,
    Input,
    ModelFile,
    Output,
    State,
)
from slipbench.identification.signals.aligned import Aligned, aligned
from slipbench.identification.signals.clocks import BUS
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.recording import Recording

Integers = NDArray[np.intp]
LEAST = 30  # bins
STRETCH = 30  # bins, if the file tells nothing
FINER = 4
"""Rows for each sample of a smooth input, which bends between its samples."""
MOST_ROWS = 2_000_000
MOST_FINE_ROWS = 200_000
"""Rows up to which they are as short as a step of integration where samples fall within them."""
WITHIN = 0.02
"""Of a row: a sample farther from its begin and its end is within it."""
ALIKE = 0.7
"""Least correlation at which a clock may be laid: half of what one tells is in the other."""
SLACK = 1e-3
"""Of a row: a value that is told this close to its begin or end is told there."""
SPREAD_AT_FIRST = 0.5
"""Deviation of a state's unknown first value, in its usual magnitude."""


def prepare(recording: Recording, file: ModelFile) -> Record:
    """Make a recording ready. Raises InputError where an input or every output is missing."""
    data = aligned(usable(recording, file))
    _check_inputs(data, file)
    shown = [n for n, o in file.outputs.items() if data.has(o.role) or _on_own_clock(data, o.role)]
    if not shown:
        raise InputError(
            "no output of the model file was recorded",
            where=str(recording.folder),
            expected=", ".join(o.role for o in file.outputs.values()),
            found="; ".join(f"{r}: {w}" for r, w in data.absent.items())
            or ", ".join(data.time)
            or "no channels",
            remedy="check the role map and the sensors",
        )
    _check_starts(file, shown, str(recording.folder))
    start, end, notes = window(data, file, _covering(data, file, shown))
    grid = _grid(data, file, start, end, shown)
    time: Floats = np.asarray(start + grid.step * np.arange(1, grid.rows + 1), np.float64)
    inputs = np.empty((grid.rows, len(file.inputs)))
    for k, name in enumerate(file.inputs):
        inputs[:, k] = _input(data, file, name, time, grid.step)
    sensors = {name: _sensor(data, file, name, start, grid) for name in shown}
    measured = {name: _at(data, file.outputs[name].role, 0.0, time) for name in shown}
    slow = np.column_stack((_slow(file, grid), *_input_noise(data, file, inputs, grid)))
    left_out = tuple(
        f"{o.role}: {data.absent[o.role]}"
        for n, o in file.outputs.items()
        if n not in shown and o.role in data.absent
    )
    name = recording.folder.name
    notes = (*notes, *sparse_outputs(data, file, shown), *coarse_inputs(data, file))
    return Record(name, start, grid, inputs, measured, sensors, slow, notes, left_out)


def _covering(data: Aligned, file: ModelFile, shown: list[str]) -> list[Floats]:
    """Times of the inputs; without inputs those of the outputs, on one clock where some are."""
    inputs = [told.role for told in file.inputs.values()]
    roles = inputs or [file.outputs[name].role for name in shown]
    on_bus = [role for role in roles if data.has(role)]
    return [_times(data, role) for role in on_bus or roles]


def _check_starts(file: ModelFile, shown: list[str], where: str) -> None:
    """Raise InputError where a state starts from an output that was not recorded."""
    for name, state in file.states.items():
        if isinstance(state.start, str) and state.start not in shown:
            raise InputError(
                f"the state {name!r} starts from an output that was not recorded",
                where=where,
                expected=f"the role {file.outputs[state.start].role!r} of output {state.start!r}",
                found=f"outputs {', '.join(shown)}",
                remedy="give states." + name + ".start a value in the model file",
            )


def realigned(record: Record, recording: Recording, file: ModelFile, simulated: Columns) -> Record:
    """Lay channels on clocks of their own onto the recording's, by what a simulation shows.

    The clock of each is set so that what it tells resembles most what it should.
    """
    data, sensors = aligned(recording), dict(record.sensors)
    notes, left_out = list(record.notes), list(record.left_out)
    for name in record.sensors:
        role = file.outputs[name].role
        if _on_own_clock(data, role):
            channel = recording.channels[role]
            start, alike = best_shift(
                record.grid.step, simulated[name], channel.time, channel.value
            )
            if abs(alike) < ALIKE:
                left_out.append(
                    f"{role}: its clock {channel.clock!r} cannot be aligned: no channel is on both"
                    f" clocks, and the correlation with the simulation is at most {abs(alike):.2f}"
                )
                del sensors[name]
                continue
            sensors[name] = _sensor(data, file, name, start, record.grid)
            notes.append(
                f"the clock {channel.clock!r} of {name.replace('_', ' ')} is"
                f" {start - record.start:.3f} s ahead of the recording's: at this offset its"
                f" correlation with the simulation is {alike:.4f}"
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
    for name, told in file.inputs.items():
        if not data.has(told.role):
            raise InputError(
                f"the input {name!r} was not recorded",
                where=str(data.recording.folder),
                expected=f"the role {told.role}",
                found=data.absent.get(told.role, ", ".join(data.time)),
                remedy="check the role map, or use a recorded signal as the input of the model file",
            )


def _period(time: Floats) -> float:
    """Time between two samples, as a rule."""
    return float((time[-1] - time[0]) / max(time.size - 1, 1))


def _grid(data: Aligned, file: ModelFile, start: float, end: float, shown: list[str]) -> Grid:
    """Rows as long as the fastest input's period, or a step where samples fall within rows.

    Without inputs they are as long as a bin, or as a step.
    """
    width, length = file.period, end - start
    periods = (
        _period(data.time[i.role]) / (FINER if i.smooth else 1) for i in file.inputs.values()
    )
    driven = min(periods, default=width)
    per = max(1, round(width / min(driven, width)))
    finer = max(per, math.ceil(width / file.step - 1e-9))
    if length * finer / width <= MOST_FINE_ROWS and _falls_within(
        data, file, start, width / per, shown
    ):
        per = finer
    step = width / per
    rows = int(length / step + 1e-6)
    bins = (rows - 2 * per) // per
    if bins < LEAST or rows > MOST_ROWS:
        raise InputError(
            "the recording is too short" if bins < LEAST else "the recording is too long",
            where=str(data.recording.folder),
            expected=f"{LEAST} bins of {width:.3g} s up to {MOST_ROWS} rows",
            found=f"{length:.3g} s in rows of {step:.3g} s",
            remedy="give a longer segment" if bins < LEAST else "give a segment, as in run@0:60",
        )
    # A quarter of a bin apart from the instants of regular samples, so that each has its own.
    stretch = min(file.stretch or STRETCH * width, bins * width)
    return Grid(rows, 1.25 * width, int(bins), width, step, stretch)


def _falls_within(
    data: Aligned, file: ModelFile, start: float, step: float, shown: list[str]
) -> bool:
    """Tell whether samples of inputs or outputs fall within rows: there lines stand for motion.

    Rows of a step of integration cost no more integration, except outside.
    """
    if any(isinstance(told, DrivenInput) for told in file.inputs.values()):
        return False
    outputs = (file.outputs[name] for name in shown)
    channels: list[Input | Output] = [*file.inputs.values(), *outputs]
    for told in channels:
        if data.has(told.role) and not (isinstance(told, Input) and told.slope_over > 0.0):
            place = (data.time[told.role] - told.latency - start) / step
            if np.abs(place - np.round(place)).max() > WITHIN:
                return True
    return False


def _at(data: Aligned, role: str, latency: float, time: Floats) -> Floats:
    """Values along lines between samples."""
    channel = data.recording.channels[role]
    sampled = _times(data, role)
    keep = np.isfinite(channel.value) & np.isfinite(sampled)
    return np.interp(time, sampled[keep] - latency, channel.value[keep])


def _on_own_clock(data: Aligned, role: str) -> bool:
    """Tell whether a channel's clock has nothing in common with the bus's."""
    channel = data.recording.channels.get(role)
    return channel is not None and channel.clock != BUS and channel.arrival is None


def _times(data: Aligned, role: str) -> Floats:
    """Times of a channel on the bus clock, or on its own where that cannot be laid onto it."""
    return data.time[role] if data.has(role) else data.recording.channels[role].time


def _input(data: Aligned, file: ModelFile, name: str, time: Floats, step: float) -> Floats:
    """Value of a row: the mean over it of what was told last if held, else the value at its end."""
    told = file.inputs[name]
    if told.slope_over > 0.0:
        return _slope(_at(data, told.role, told.latency, time), told.slope_over, step)
    channel = data.recording.channels[told.role]
    sampled = data.time[told.role] - told.latency
    keep = np.isfinite(channel.value) & np.isfinite(sampled)
    if told.smooth:
        return np.asarray(interpolate.CubicSpline(sampled[keep], channel.value[keep])(time))
    if not told.held:
        return _at(data, told.role, told.latency, time)
    values = np.asarray(channel.value[keep], np.float64)
    if isinstance(told, DrivenInput) and told.exact:
        return values[_last(sampled[keep], time - step, SLACK * step)]
    return _held(sampled[keep], values, time, step)


def _held(sampled: Floats, values: Floats, time: Floats, step: float) -> Floats:
    """Mean over each row of what was told last: a value told within a row acts from then on.

    With what was told when a row began it would act up to a row later: half a row in the mean, as a
    dead time. sampled, values: (n,); time: s, of the rows' ends.
    """
    before = np.concatenate(([0.0], np.cumsum(values[:-1] * np.diff(sampled))))

    def area(t: Floats) -> Floats:
        k = _last(sampled, t, 0.0)
        return np.asarray(before[k] + values[k] * (t - sampled[k]))

    begun = _last(sampled, time - step, SLACK * step)
    ended = _last(sampled, time, -SLACK * step)
    mean = (area(time) - area(time - step)) / step
    return np.where(ended > begun, mean, values[begun])


def _last(sampled: Floats, time: Floats, slack: float) -> Integers:
    """Number of the last sample at each time, or up to slack after it; the first before all."""
    found = np.searchsorted(sampled, time + slack, side="right") - 1
    return np.clip(found, 0, len(sampled) - 1)


def _slope(values: Floats, span: float, step: float) -> Floats:
    """Slope of the straight line that fits best over a span about every row: late by nothing."""
    rows = max(3, 2 * round(0.5 * span / step) + 1)
    if rows >= values.size:
        return np.gradient(values, step)
    found: Floats = signal.savgol_filter(values, rows, 1, deriv=1, delta=step)
    return found


def _sensor(data: Aligned, file: ModelFile, name: str, start: float, grid: Grid) -> Sensor:
    told = file.outputs[name]
    channel = data.recording.channels[told.role]
    time = _times(data, told.role) - told.latency - start
    keep = np.isfinite(channel.value) & np.isfinite(time)
    samples = Sampled(time[keep], channel.value[keep], channel.clock)
    noise = told.noise.si
    return point_sensor(name, told.size.si_unit, name, 1.0, samples, grid, noise)


def _slow(file: ModelFile, grid: Grid) -> Floats:
    """Pushes on the rates of states: one at the first moment each, then hats where told.

    Columns in the order of `slow_places`.
    """
    first = np.zeros((grid.rows, len(file.states)))
    first[:1] = [_spread(state) / grid.step for state in file.states.values()]
    tents = [
        _tents(grid, state.every or grid.stretch).T * state.drift.si
        for state in file.states.values()
        if state.drift is not None
    ]
    return np.concatenate((first, *tents), axis=1)


def first_of(state: str, file: ModelFile) -> tuple[int, float] | None:
    """Return the number of the column of a state's first value, and how much it is per unit, SI."""
    names = [*file.states]
    return (names.index(state), _spread(file.states[state])) if state else None


def _spread(state: State) -> float:
    return SPREAD_AT_FIRST * state.size.si if state.first is None else state.first.si


def _tents(grid: Grid, every: float) -> Floats:
    time = grid.step * (np.arange(grid.rows) + 0.5)
    knots = np.linspace(0.0, time[-1], max(int(time[-1] / every), 1) + 1)
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(time - knots[:, None]) / (knots[1] - knots[0])))


def _input_noise(data: Aligned, file: ModelFile, inputs: Floats, grid: Grid) -> list[Floats]:
    """Symmetric filters of the inputs that may hold noise, after the pushes on states."""
    columns = []
    for values, told in zip(inputs.T, file.inputs.values(), strict=True):
        if told.noisy:
            rows = _period(data.time[told.role]) / grid.step
            samples = values[:: max(round(rows), 1)]
            noise = noise_of(samples) if told.noise is None else told.noise.si
            columns += smoothings(values, rows, noise)
    return columns


def slow_places(file: ModelFile, grid: Grid) -> list[int]:
    """Number of the place, as the kernel has them, on which each slow column acts."""
    rates = range(
        len(file.inputs) + len(file.seams), len(file.states) + len(file.inputs) + len(file.seams)
    )
    found = [*rates]
    for k, state in zip(rates, file.states.values(), strict=True):
        if state.drift is not None:
            found += [k] * len(_tents(grid, state.every or grid.stretch))
    noisy = [k for k, told in enumerate(file.inputs.values()) if told.noisy]
    return found + [k for k in noisy for _ in WIDTHS]

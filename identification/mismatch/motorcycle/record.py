"""A recording of a motorcycle made ready: inputs row by row, sensors, and what was measured.

Inputs are what was echoed and measured, on the bus clock less the latency that the vehicle file
tells of; commands are held. What a simulation is compared with stands in its sensors.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.motorcycle.slow_road import road_tents
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sampling import Grid, at_points, at_points_sharp
from slipbench.identification.mismatch.simulation.sensor import (
    Sampled,
    Sensor,
    point_sensor,
    tooth_sensors,
)
from slipbench.identification.signals.aligned import Aligned, aligned
from slipbench.identification.signals.dataset import Dataset, dataset
from slipbench.identification.signals.samples import averaged, onto, sampled
from slipbench.identification.signals.teeth import speed_from_teeth
from slipbench.identification.signals.trial_window import TrialWindow, trial_window
from slipbench.plant.channels import ChannelTiming
from slipbench.plant.signals import Floats, Inputs
from slipbench.plant.vehicle_file import Vehicle
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.recording import Recording

STEP = 1e-3  # s, between rows of the simulation
LEAD_IN = 1.0  # s, in which the simulation settles, its speed led by the recorded one
BIN = 0.01  # s
TICKING = 0.7
"""Length of the mean phase from which on commands come in the rhythm of rows."""
LONGEST = 120.0  # s, of one piece
PARTS = 2
"""Of a stretch of 3 s, each as long as the slow road takes from one knot to the next: what hangs
together for longer is the road's."""
OVERHANG = 0.03  # s at the end: a tooth interval that begins in the last bin ends behind it
LINEAR: Mapping[str, tuple[str, str]] = {
    "throttle_position": ("throttle", "1"),
    "engine_speed": ("engine_speed", "rad/s"),
    "optical_speed": ("optical_speed", "m/s"),
    "gnss_speed": ("speed", "m/s"),
    "vehicle_speed": ("speed", "m/s"),
}
"""Role -> column of the simulation that it shows, and the unit."""
SWINGING = ("engine_speed",)
"""Columns that may swing within a few rows."""
SPEEDS = (
    "engine_speed",
    "optical_speed",
    "gnss_speed",
    "vehicle_speed",
    "rear_wheel_speed",
    "front_wheel_speed",
)
WHEELS = ("rear", "front")
TRUE_SPEED = ("front", "optical_speed", "gnss_speed", "vehicle_speed")
"""Where the speed that leads a simulation in is taken from, best first."""


def prepare(recording: Recording, vehicle: Vehicle) -> Record:
    """Make a recording ready. Raises InputError where nothing in it can drive a simulation."""
    data = aligned(without_dead(recording))
    left_out = tuple(f"{role}: {why}" for role, why in data.absent.items())
    base = dataset(data)
    start, end = _window(data, base)
    start += _phase_of_commands(data, vehicle, start)
    rows = int((end - start) / STEP)
    bins = int((rows * STEP - LEAD_IN - OVERHANG) / BIN)
    if bins < 100:
        raise InputError(
            "the recording is too short",
            where=str(recording.folder),
            expected="at least 2 s in which all channels are recorded",
            found=f"{end - start:.2f} s",
        )
    grid = Grid(rows, LEAD_IN, bins, BIN, STEP, min(Grid.stretch, bins * BIN), PARTS)
    time = np.asarray(start + STEP * np.arange(1, rows + 1))
    sensors = _sensors(data, vehicle, start, grid)
    measured = _measured(data, vehicle, time)
    inputs = _inputs(data, base, vehicle, time, measured)
    slow = road_tents(rows, vehicle.motorcycle.body.mass, LEAD_IN, STEP)
    return Record(
        recording.folder.name, start, grid, inputs.table, measured, sensors, slow, left_out=left_out
    )


def without_dead(recording: Recording) -> Recording:
    """Return the recording without channels that tell one value throughout while others move.

    A throttle may rest; a speed that never changes by a quantum is no measurement.
    """
    moved = any(
        np.ptp(c.value) > 0.0
        for role, c in recording.channels.items()
        if c.value.size and role.endswith(("teeth", "speed"))
    )
    dead = {
        role: f"constant at {recording.channels[role].value[0]:.6g} ({c.origin})"
        for role, c in recording.channels.items()
        if moved and role in SPEEDS and c.value.size and np.ptp(c.value) == 0.0
    }
    channels = {r: c for r, c in recording.channels.items() if r not in dead}
    return replace(recording, channels=channels, missing={**recording.missing, **dead})


def _window(data: Aligned, base: Dataset) -> tuple[float, float]:
    """Take the trial's excitation with what leads in, else all that every channel covers."""
    used = [t for role, t in data.time.items() if role in (*LINEAR, "rear_teeth", "front_teeth")]
    if not used:
        raise InputError(
            "no channel that can be compared with the simulation",
            where=str(data.recording.folder),
            expected=", ".join((*LINEAR, "rear_teeth", "front_teeth")),
            found="; ".join(f"{r}: {w}" for r, w in data.absent.items())
            or ", ".join(data.time)
            or "no channels",
            remedy="check the role map and the sensors",
        )
    first, last = max(t[0] for t in used) + 0.02, min(t[-1] for t in used) - 0.02
    window = trial_window(base)
    if isinstance(window, TrialWindow):
        exciting = base.time[window.exciting]
        first = max(first, float(exciting[0]) - LEAD_IN - 0.25)
        last = min(last, float(exciting[-1]) + (0.0 if window.trip else 0.5))
    return float(first), float(min(last, first + LONGEST))


def _phase_of_commands(data: Aligned, vehicle: Vehicle, start: float) -> float:
    """Return how far from a start commands begin to hold, s, where they come row by row.

    Rows that begin with them hold one command each. A step smeared over a row would set off what
    saturates too early: its first share is as good as all of it.
    """
    for role in ("throttle_command", "spark_command"):
        if data.has(role):
            phase = np.exp(2j * np.pi * (_at(data, vehicle, role) - start) / STEP)
            mean = complex(np.nanmean(phase))
            turn = float(np.angle(mean)) / (2.0 * np.pi)
            return turn * STEP if abs(mean) > TICKING else 0.0
    return 0.0


def _at(data: Aligned, vehicle: Vehicle, role: str) -> Floats:
    """Times at which a channel holds: on the bus clock, less its clock's least latency."""
    return data.time[role] - _least_latency(data, vehicle, role)


def _least_latency(data: Aligned, vehicle: Vehicle, role: str) -> float:
    clock = data.recording.channels[role].clock
    same = [r for r, c in data.recording.channels.items() if c.clock == clock or r == role]
    told = [vehicle.channels[r].latency for r in same if r in vehicle.channels]
    return min(told) if told and clock != "bus" else _own_latency(vehicle, role)


def _own_latency(vehicle: Vehicle, role: str) -> float:
    return vehicle.channels[role].latency if role in vehicle.channels else 0.0


def _sampled(data: Aligned, vehicle: Vehicle, role: str, start: float) -> Sampled:
    channel = data.recording.channels[role]
    time = _at(data, vehicle, role)
    keep = np.isfinite(time) & np.isfinite(channel.value)
    return Sampled(time[keep] - start, channel.value[keep], channel.clock)


def _sensors(data: Aligned, vehicle: Vehicle, start: float, grid: Grid) -> dict[str, Sensor]:
    found = dict[str, Sensor]()
    for role, (column, unit) in LINEAR.items():
        if data.has(role):
            samples = _sampled(data, vehicle, role, start)
            told = vehicle.channels.get(role, ChannelTiming())
            between = at_points_sharp if column in SWINGING else at_points
            found[role] = point_sensor(
                role, unit, column, 1.0, samples, grid, told.noise, told.quantum, between
            )
    for wheel in WHEELS:
        if data.has(f"{wheel}_teeth"):
            per_turn = int(getattr(vehicle.motorcycle, f"{wheel}_encoder").teeth)
            samples = _sampled(data, vehicle, f"{wheel}_teeth", start)
            speed, pattern = tooth_sensors(wheel, samples, per_turn, grid)
            found |= {speed.name: speed, pattern.name: pattern}
        elif data.has(f"{wheel}_wheel_speed"):
            role, radius = f"{wheel}_wheel_speed", _radius(data, vehicle, wheel)
            samples = _sampled(data, vehicle, role, start)
            found[role] = point_sensor(role, "m/s", f"{wheel}_speed", radius, samples, grid)
    return found


def _radius(data: Aligned, vehicle: Vehicle, wheel: str) -> float:
    """Radius with which the recording turned the wheel's speed into a peripheral speed."""
    told = getattr(data.recording.roles.vehicle, f"{wheel}_radius")
    return float(told or getattr(vehicle.motorcycle, f"{wheel}_wheel").radius)


def _measured(data: Aligned, vehicle: Vehicle, time: Floats) -> dict[str, Floats]:
    """Put what was measured onto the rows' ends; wheels in rad/s."""
    found = dict[str, Floats]()
    for role in (*LINEAR, "lean_angle"):
        if data.has(role):
            samples = sampled(_at(data, vehicle, role), data.recording.channels[role].value)
            found[role] = _filled(onto(samples, time))
    for wheel in WHEELS:
        if data.has(role := f"{wheel}_teeth"):
            channel = data.recording.channels[role]
            per_turn = int(getattr(vehicle.motorcycle, f"{wheel}_encoder").teeth)
            passed = _at(data, vehicle, role)
            speed = speed_from_teeth(passed, channel.value, per_turn)
            found[wheel] = _filled(onto(speed, time))
            known = np.isfinite(passed) & np.isfinite(channel.value)
            turned = np.interp(time, passed[known], channel.value[known])
            found[f"{wheel}_turned"] = 2.0 * np.pi / per_turn * turned
        elif data.has(role := f"{wheel}_wheel_speed"):
            samples = sampled(_at(data, vehicle, role), data.recording.channels[role].value)
            found[wheel] = _filled(onto(samples, time)) / _radius(data, vehicle, wheel)
    return found


def _filled(values: Floats) -> Floats:
    """Bridge what is not known with straight lines."""
    known = np.isfinite(values)
    if known.all() or not known.any():
        return values
    places = np.arange(values.size)
    return np.interp(places, places[known], values[known])


def _inputs(
    data: Aligned, base: Dataset, vehicle: Vehicle, time: Floats, measured: Mapping[str, Floats]
) -> Inputs:
    columns = dict[str, Floats | float]()
    for role, column in (("throttle_command", "throttle_command"), ("spark_command", "spark")):
        if data.has(role):
            samples = sampled(_at(data, vehicle, role), data.recording.channels[role].value)
            # A sample is stamped when it begins to hold; a row ends at its time.
            columns[column] = _filled(averaged(samples, time - 0.5 * STEP))
    columns["gear"] = _gear(data, base, vehicle, measured)
    if "throttle_command" not in columns and "throttle_position" in measured:
        columns["throttle_command"] = measured["throttle_position"]
    return Inputs.held(time.size, **columns)


def _gear(data: Aligned, base: Dataset, vehicle: Vehicle, measured: Mapping[str, Floats]) -> float:
    """Take the gear that was told, else the trial's, else the one nearest to the speeds' ratio."""
    told = base.get("gear")
    if told is not None and np.isfinite(told).any():
        return float(np.nanmedian(told))
    if data.recording.trial is not None:
        return float(data.recording.trial.operating_point.gear)
    if "engine_speed" in measured and "rear" in measured:
        ratio = float(np.median(measured["engine_speed"] / np.maximum(measured["rear"], 1.0)))
        gears = np.array(vehicle.motorcycle.gears)
        return float(1 + int(np.argmin(np.abs(np.log(gears / max(ratio, 1e-3))))))
    return 1.0

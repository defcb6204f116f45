"""Preparation of a motorcycle's recording: inputs row by row, sensors, and measured signals.

Inputs are echoed and measured signals, on the bus clock less the latency that the vehicle file
states; commands are held. The sensors hold the outputs with which a simulation is compared.
"""

from collections.abc import Iterator, Mapping
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
LEAD_IN = 1.0  # s, warm-up of the simulation, driven by the recorded speed
BIN = 0.01  # s
TICKING = 0.7
"""Length of the mean phasor above which commands are synchronous with rows."""
LONGEST = 120.0  # s, of one piece
PARTS = 2
"""Clusters in a segment of 3 s, each as long as the knot spacing of the slow road force, which
models longer correlations."""
OVERHANG = 0.03  # s at the end: a tooth interval that begins in the last bin ends after it
LINEAR: Mapping[str, tuple[str, str]] = {
    "throttle_position": ("throttle", "1"),
    "engine_speed": ("engine_speed", "rad/s"),
    "optical_speed": ("optical_speed", "m/s"),
    "gnss_speed": ("speed", "m/s"),
    "vehicle_speed": ("speed", "m/s"),
}
"""Role -> column of the simulation that it measures, and the unit."""
SWINGING = ("engine_speed",)
"""Columns that may oscillate within a few rows."""
SPEEDS = (
    "engine_speed",
    "optical_speed",
    "gnss_speed",
    "vehicle_speed",
    "rear_wheel_speed",
    "front_wheel_speed",
)
COMPARED = ("spark_command", "spark_advance", "lean_angle")
"""Physical quantities beside speeds that the simulation or its curves depend on."""
PHYSICAL_UNITS = ("K", "Pa", "m", "rad", "rad/s", "m/s", "m/s^2", "A")
WHEELS = ("rear", "front")
TRUE_SPEED = ("front", "optical_speed", "gnss_speed", "vehicle_speed")
"""Sources of the speed that drives the warm-up of a simulation, best first."""


def prepare(recording: Recording, vehicle: Vehicle) -> Record:
    """Prepare a recording. Raises InputError where it is too short or no channel is comparable."""
    data = aligned(without_dead(recording))
    left_out = (*(f"{role}: {why}" for role, why in data.absent.items()), *_without_equation(data))
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


def _without_equation(data: Aligned) -> Iterator[str]:
    """Yield what says which physical quantities moved and are in no equation of a vehicle file."""
    channels = data.recording.channels
    moved = {r for r in data.time if channels[r].value.size and np.ptp(channels[r].value) > 0.0}
    physical = {role for role in moved if channels[role].unit in PHYSICAL_UNITS}
    roles = sorted(physical - {*SPEEDS, *COMPARED})
    if roles:
        yield f"{', '.join(roles)}: recorded, but no equation of a vehicle file has it"


def without_dead(recording: Recording) -> Recording:
    """Return the recording without speed channels that are constant while other channels move.

    A throttle may rest; a speed that never changes by a quantum is not a measurement.
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
    """Return start and end: of warm-up and excitation of a trial, else of all channels' overlap."""
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
    """Return the delay from a start to the next command, s; 0 where commands are not periodic.

    Rows that begin with a command hold one command each. A step that is spread over two rows would
    cause saturation too early, since its first part may already be sufficient.
    """
    for role in ("throttle_command", "spark_command"):
        if data.has(role):
            phase = np.exp(2j * np.pi * (_at(data, vehicle, role) - start) / STEP)
            mean = complex(np.nanmean(phase))
            fraction = float(np.angle(mean)) / (2.0 * np.pi)
            return fraction * STEP if abs(mean) > TICKING else 0.0
    return 0.0


def _at(data: Aligned, vehicle: Vehicle, role: str) -> Floats:
    """Times of validity of a channel: on the bus clock, less the least latency of its clock."""
    return data.time[role] - _least_latency(data, vehicle, role)


def _least_latency(data: Aligned, vehicle: Vehicle, role: str) -> float:
    clock = data.recording.channels[role].clock
    same = [r for r, c in data.recording.channels.items() if c.clock == clock or r == role]
    latencies = [vehicle.channels[r].latency for r in same if r in vehicle.channels]
    return min(latencies) if latencies and clock != "bus" else _own_latency(vehicle, role)


def _own_latency(vehicle: Vehicle, role: str) -> float:
    return vehicle.channels[role].latency if role in vehicle.channels else 0.0


def _sampled(data: Aligned, vehicle: Vehicle, role: str, start: float) -> Sampled:
    channel = data.recording.channels[role]
    time = _at(data, vehicle, role)
    keep = np.isfinite(time) & np.isfinite(channel.value)
    return Sampled(time[keep] - start, channel.value[keep], channel.clock)


def _sensors(data: Aligned, vehicle: Vehicle, start: float, grid: Grid) -> dict[str, Sensor]:
    sensors = dict[str, Sensor]()
    for role, (column, unit) in LINEAR.items():
        if data.has(role):
            samples = _sampled(data, vehicle, role, start)
            timing = vehicle.channels.get(role, ChannelTiming())
            between = at_points_sharp if column in SWINGING else at_points
            sensors[role] = point_sensor(
                role, unit, column, 1.0, samples, grid, timing.noise, timing.quantum, between
            )
    for wheel in WHEELS:
        if data.has(f"{wheel}_teeth"):
            per_turn = int(getattr(vehicle.motorcycle, f"{wheel}_encoder").teeth)
            samples = _sampled(data, vehicle, f"{wheel}_teeth", start)
            speed, pattern = tooth_sensors(wheel, samples, per_turn, grid)
            sensors |= {speed.name: speed, pattern.name: pattern}
        elif data.has(f"{wheel}_wheel_speed"):
            role, radius = f"{wheel}_wheel_speed", _radius(data, vehicle, wheel)
            samples = _sampled(data, vehicle, role, start)
            sensors[role] = point_sensor(role, "m/s", f"{wheel}_speed", radius, samples, grid)
    return sensors


def _radius(data: Aligned, vehicle: Vehicle, wheel: str) -> float:
    """Radius by which the recording converts the wheel's speed to a peripheral speed, m."""
    stated = getattr(data.recording.roles.vehicle, f"{wheel}_radius")
    return float(stated or getattr(vehicle.motorcycle, f"{wheel}_wheel").radius)


def _measured(data: Aligned, vehicle: Vehicle, time: Floats) -> dict[str, Floats]:
    """Measured signals at the ends of rows; wheels in rad/s."""
    measured = dict[str, Floats]()
    for role in (*LINEAR, "lean_angle"):
        if data.has(role):
            samples = sampled(_at(data, vehicle, role), data.recording.channels[role].value)
            measured[role] = _filled(onto(samples, time))
    for wheel in WHEELS:
        if data.has(role := f"{wheel}_teeth"):
            channel = data.recording.channels[role]
            per_turn = int(getattr(vehicle.motorcycle, f"{wheel}_encoder").teeth)
            passed = _at(data, vehicle, role)
            speed = speed_from_teeth(passed, channel.value, per_turn)
            measured[wheel] = _filled(onto(speed, time))
            known = np.isfinite(passed) & np.isfinite(channel.value)
            teeth = np.interp(time, passed[known], channel.value[known])
            measured[f"{wheel}_turned"] = 2.0 * np.pi / per_turn * teeth
        elif data.has(role := f"{wheel}_wheel_speed"):
            samples = sampled(_at(data, vehicle, role), data.recording.channels[role].value)
            measured[wheel] = _filled(onto(samples, time)) / _radius(data, vehicle, wheel)
    return measured


def _filled(values: Floats) -> Floats:
    """Interpolate unknown values linearly."""
    known = np.isfinite(values)
    if known.all() or not known.any():
        return values
    index = np.arange(values.size)
    return np.interp(index, index[known], values[known])


def _inputs(
    data: Aligned, base: Dataset, vehicle: Vehicle, time: Floats, measured: Mapping[str, Floats]
) -> Inputs:
    columns = dict[str, Floats | float]()
    for role, column in (("throttle_command", "throttle_command"), ("spark_command", "spark")):
        if data.has(role):
            samples = sampled(_at(data, vehicle, role), data.recording.channels[role].value)
            # A sample has the time at which it begins to hold; a row has the time of its end.
            columns[column] = _filled(averaged(samples, time - 0.5 * STEP))
    columns["gear"] = _gear(data, base, vehicle, measured)
    if "throttle_command" not in columns and "throttle_position" in measured:
        columns["throttle_command"] = measured["throttle_position"]
    return Inputs.held(time.size, **columns)


def _gear(data: Aligned, base: Dataset, vehicle: Vehicle, measured: Mapping[str, Floats]) -> float:
    """Return the recorded gear, else the trial's, else the one nearest to the ratio of speeds."""
    recorded = base.get("gear")
    if recorded is not None and np.isfinite(recorded).any():
        return float(np.nanmedian(recorded))
    if data.recording.trial is not None:
        return float(data.recording.trial.operating_point.gear)
    if "engine_speed" in measured and "rear" in measured:
        ratio = float(np.median(measured["engine_speed"] / np.maximum(measured["rear"], 1.0)))
        gears = np.array(vehicle.motorcycle.gears)
        return float(1 + int(np.argmin(np.abs(np.log(gears / max(ratio, 1e-3))))))
    return 1.0

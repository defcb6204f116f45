"""Candidate trials, and the record that each would give in the available channels.

A candidate is simulated on the fitted vehicle and measured by sensors like the recorded ones.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from slipbench.identification.mismatch.motorcycle.record import BIN, LEAD_IN, OVERHANG, STEP
from slipbench.identification.mismatch.motorcycle.slow_road import road_tents
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sampling import Grid
from slipbench.identification.mismatch.simulation.sensor import (
    Sampled,
    Sensor,
    point_sensor,
    tooth_sensors,
)
from slipbench.plant.encoder import begin, passing_teeth, toothed_disc
from slipbench.plant.equilibrium import equilibrium
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Floats, Inputs, Outputs
from slipbench.plant.simulation import Simulation
from slipbench.protocol.waveforms import end_at_zero, linear_sweep, odd_multisine, square_wave

SECONDS = 12.0
BEGINS = LEAD_IN + 0.25  # s, start of the excitation in the record
AFTER = 0.5  # s of the record after the excitation
PERIODS_PLAYED = 4  # of a multisine
RPM = np.pi / 30
PERIODS = {"throttle_position": 1e-3, "engine_speed": 5e-3, "optical_speed": 4e-3}  # s, of samples
USUAL = 0.01  # s, of samples of other channels


@dataclass(frozen=True)
class Choice:
    """A trial about an operating point.

    gear; engine_speed: rad/s; actuator: "throttle" or "spark"; waveform: "linear_sweep", "square"
    or "multisine"; amplitude: opening, or rad of spark; low: Hz, the frequency of a square wave;
    high: Hz; seconds: of the excitation; rate: 1/s or rad/s, largest slope of a square wave
    """

    gear: int
    engine_speed: float
    actuator: str
    waveform: str
    amplitude: float
    low: float
    high: float = 12.0
    seconds: float = SECONDS
    rate: float = math.inf

    @property
    def period(self) -> float:
        """Period of a multisine, s."""
        return self.seconds / PERIODS_PLAYED

    @property
    def rows(self) -> int:
        """Rows of the record, one each `STEP`."""
        return round((BEGINS + self.seconds + AFTER) / STEP)

    def wave(self, time: Floats) -> Floats:
        """Deviation of the actuator from its operating point. time: s since the record began."""
        t = np.asarray(time) - BEGINS
        inside = (t >= 0.0) & (t < self.seconds)
        wave = np.zeros(t.size)
        wave[inside] = self.amplitude * self._unit(t[inside])
        if self.waveform != "square":
            wave[inside] = end_at_zero(wave[inside])
        return wave

    def _unit(self, t: Floats) -> Floats:
        if self.waveform == "square":
            return _with_ramps(t, self.low, 2.0 * self.amplitude / self.rate)
        if self.waveform == "multisine":
            return odd_multisine(t, self.period, self.low, self.high, seed=1)
        return linear_sweep(t, self.low, self.high, self.seconds)

    def __str__(self) -> str:
        """Return a description in one line."""
        shape = {"square": "square wave", "multisine": "multisine"}.get(self.waveform, "sweep")
        band = (
            f"{self.low:g} Hz" if self.waveform == "square" else f"{self.low:g} to {self.high:g} Hz"
        )
        size = (
            f"{100 * self.amplitude:.3g} %"
            if self.actuator == "throttle"
            else f"{np.degrees(self.amplitude):.3g} degrees"
        )
        speed = f"{self.engine_speed / RPM:.0f} rpm in gear {self.gear}"
        return f"a {shape} of the {self.actuator} {band}, {size}, at {speed}"


def _with_ramps(t: Floats, frequency: float, ramp: float) -> Floats:
    """Square wave (Hz) with ramps (s): its mean over the ramp time before each instant."""
    if ramp == 0.0:
        return square_wave(t, frequency)
    return np.asarray((_area(t, frequency) - _area(np.maximum(t - ramp, 0.0), frequency)) / ramp)


def _area(t: Floats, frequency: float) -> Floats:
    """Integral of a square wave from time 0, s."""
    half = np.mod(2.0 * frequency * t, 2.0)
    return np.asarray(np.minimum(half, 2.0 - half) / (2.0 * frequency))


def menu(gears: int) -> Iterator[Choice]:
    """Yield every candidate trial: speeds, gears, amplitudes and waveforms."""
    for gear in range(2, min(gears, 3) + 1):
        for rpm in (7000.0, 10000.0, 13000.0):
            yield Choice(gear, rpm * RPM, "throttle", "linear_sweep", 0.03, 0.5, 14.0)
            yield Choice(gear, rpm * RPM, "throttle", "square", 0.08, 0.8)
            yield Choice(gear, rpm * RPM, "spark", "linear_sweep", 0.06, 0.5, 14.0)


def rehearse(bike: Motorcycle, like: Record, choice: Choice) -> Record:
    """Return the simulated record of a trial. Raises ValueError where it cannot be simulated."""
    simulation = Simulation(bike, STEP / 2, 2, 2)
    state, throttle = equilibrium(simulation, choice.gear, choice.engine_speed)
    rows, warm_up = choice.rows, round(LEAD_IN / STEP)
    time: Floats = np.asarray(STEP * np.arange(1, rows + 1))
    inputs = Inputs.held(rows, gear=float(choice.gear), throttle_command=throttle)
    column = inputs.throttle_command if choice.actuator == "throttle" else inputs.spark
    column += choice.wave(time)
    np.clip(inputs.throttle_command, 0.0, 1.0, out=inputs.throttle_command)
    _, out = simulation.advance(state, inputs)
    grid = Grid(rows, LEAD_IN, int(((rows - warm_up) * STEP - OVERHANG) / BIN), BIN, STEP)
    sensors, measured = _sensors(bike, like, out, time, grid), _measured(like, out)
    slow = road_tents(rows, bike.body.mass, LEAD_IN, STEP)
    return Record(str(choice), 0.0, grid, inputs.table, measured, sensors, slow)


def _sensors(
    bike: Motorcycle, recorded: Record, out: Outputs, time: Floats, grid: Grid
) -> dict[str, Sensor]:
    sensors = dict[str, Sensor]()
    for name, like in recorded.sensors.items():
        if like.offsets is None:
            (column,) = like.observation
            every = round(PERIODS.get(name, USUAL) / STEP)
            samples = Sampled(time[every - 1 :: every], out[column][every - 1 :: every], like.clock)
            sensors[name] = point_sensor(name, like.unit, column, 1.0, samples, grid)
        elif name.endswith("_teeth"):
            wheel = name.removesuffix("_teeth")
            speed, pattern = tooth_sensors(
                wheel, _teeth(bike, out, time, wheel, like.clock), like.offsets.shape[1], grid
            )
            sensors |= {speed.name: speed, pattern.name: pattern}
    return sensors


def _teeth(bike: Motorcycle, out: Outputs, time: Floats, wheel: str, clock: str) -> Sampled:
    disc = toothed_disc(getattr(bike, f"{wheel}_encoder"))
    angle, speed = out[f"{wheel}_angle"], out[f"{wheel}_speed"]
    start = begin(float(time[0]), float(angle[0]), float(speed[0]))
    _, passed = passing_teeth(disc, start, time, angle, speed)
    ticks: Floats = np.asarray(passed.ticks * disc.resolution, np.float64)
    return Sampled(ticks, passed.numbers.astype(float), clock)


def _measured(like: Record, out: Outputs) -> dict[str, Floats]:
    columns = {
        "throttle_position": "throttle",
        "rear": "rear_speed",
        "front": "front_speed",
        "rear_turned": "rear_angle",
        "front_turned": "front_angle",
        "gnss_speed": "speed",
        "vehicle_speed": "speed",
    }
    names = like.measured
    return {n: out[columns.get(n, n)].copy() for n in names if n != "lean_angle"}


def trial_tree(choice: Choice, name: str, vehicle: str) -> Mapping[str, Any]:
    """Return the trial as the tree of a trial file, with its limits."""
    rpm = choice.engine_speed / RPM
    return {
        "name": name,
        "description": f"Proposed by an analysis: {choice}",
        "vehicle": vehicle,
        "operating_point": {"gear": choice.gear, "engine_speed": f"{rpm:.0f} rpm"},
        "excitation": excitation_table(choice),
        "limits": {
            "throttle": ["0 %", "60 %"],
            "throttle_deviation": "10 %",
            "throttle_rate": "90000 %/s",
            "spark": ["-12 deg", "6 deg"],
            "spark_rate": "100000 deg/s",
            "engine_speed": [f"{0.6 * rpm:.0f} rpm", f"{min(1.35 * rpm, 15500.0):.0f} rpm"],
            "speed": ["5 m/s", "80 m/s"],
            "slip": "10 %",
            "distance": "3000 m",
        },
    }


def excitation_table(choice: Choice) -> dict[str, Any]:
    """Return the table [excitation] of the trial file."""
    throttle = choice.actuator == "throttle"
    table: dict[str, Any] = {
        "actuator": choice.actuator,
        "waveform": choice.waveform,
        "amplitude": f"{100 * choice.amplitude:.6g} %"
        if throttle
        else f"{np.degrees(choice.amplitude):.6g} deg",
        "duration": f"{choice.seconds:g} s",
    }
    if choice.waveform == "square":
        return table | {"frequency": f"{choice.low:g} Hz"}
    band = (f"{choice.low:g} Hz", f"{choice.high:g} Hz")
    if choice.waveform == "multisine":
        names = {"lowest": band[0], "highest": band[1], "period": f"{choice.period:g} s"}
        return table | names
    return table | {"start": band[0], "stop": band[1]}

"""Recordings of a simulated motorcycle made in memory: the plant, its disturbances, its sensors.

It does not imitate: frames, the CAN database, a bench that reacts, queues on the bus.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from slipbench.plant.encoder import begin, passing_teeth, toothed_disc
from slipbench.plant.equilibrium import equilibrium
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Inputs
from slipbench.plant.simulation import Simulation
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import Geometry, RoleMap, Source

LEAD = 1.5  # s, before the excitation


@dataclass(frozen=True)
class Ride:
    """One trial: an excitation about an operating point.

    kind: sweep, square, multisine or spark; amplitude: opening (or rad of spark). cold: torque
    that a cold engine loses at the beginning, N m; warming: time in which that decays, s.
    """

    kind: str = "sweep"
    gear: int = 2
    engine_speed: float = 1466.0
    amplitude: float = 0.03
    low: float = 0.5
    high: float = 12.0
    seconds: float = 12.0
    seed: int = 1
    wind: float = 12.0
    combustion: float = 0.8
    cold: float = 0.0
    warming: float = 4.0
    drop: tuple[str, ...] = field(default=())

    def wave(self, t):
        inside = (t >= 0) & (t < self.seconds - LEAD)
        rate = (self.high - self.low) / (self.seconds - LEAD)
        sine = np.sin(2 * np.pi * (self.low * t + 0.5 * rate * t * t))
        if self.kind == "square":
            sine = np.sign(np.sin(2 * np.pi * self.low * t))
        if self.kind == "multisine":
            rng = np.random.default_rng(7)
            lines = np.arange(self.low, self.high, 0.4)
            sine = sum(np.sin(2 * np.pi * f * t + rng.uniform(0, 6.28)) for f in lines)
            sine = sine / np.sqrt(lines.size)
        return np.where(inside, self.amplitude * sine, 0.0)


def ride(motorcycle: Motorcycle, trial: Ride) -> Recording:
    """Ride a trial and record it."""
    rng = np.random.default_rng(trial.seed)
    simulation = Simulation(motorcycle)
    state, throttle = equilibrium(simulation, trial.gear, trial.engine_speed)
    n = round(trial.seconds * 1e3)
    t = np.arange(n) * 1e-3
    wave = trial.wave(t - LEAD)
    spark = trial.kind == "spark"
    command = np.clip(throttle + (0.0 * wave if spark else wave), 0.0, 1.0)
    advance = wave if spark else np.zeros(n)
    inputs = Inputs.held(
        n,
        gear=float(trial.gear),
        throttle_command=command,
        spark=advance,
        road_force=_wind(rng, n, trial.wind),
        engine_disturbance=trial.combustion * rng.standard_normal(n)
        - trial.cold * np.exp(-t / trial.warming),
    )
    _, out = simulation.advance(state, inputs)
    maker = _Maker(rng)
    now = out.time[3::4]  # the end of each millisecond
    since = now - 1e-3  # an echo is stamped when the command begins to hold
    channels = {
        "throttle_command": maker.told("throttle_command", since, command, "ecu"),
        "spark_command": maker.told("spark_command", since, advance, "ecu"),
        "throttle_position": maker.point(
            "throttle_position", out, "throttle", 1, "throttle", 3e-4, 1e-3
        ),
        "engine_speed": maker.point("engine_speed", out, "engine_speed", 5, "ecu", 0.3, 0.1047),
        "gear": maker.told("gear", now[::100], np.full(now[::100].size, float(trial.gear)), "ecu"),
        "optical_speed": maker.point(
            "optical_speed", out, "optical_speed", 4, "optical", 0.02, 0.01
        ),
        "rear_teeth": maker.teeth("rear", motorcycle, out),
        "front_teeth": maker.teeth("front", motorcycle, out),
    }
    channels = {k: v for k, v in channels.items() if k not in trial.drop}
    roles = {role: Source(column=role, table="memory") for role in channels}
    geometry = Geometry(rear_radius=0.32, front_radius=0.3, teeth_per_turn=16)
    return Recording(
        Path(f"{trial.kind}_{trial.gear}_{trial.engine_speed:.0f}_{trial.seed}"),
        {},
        None,
        RoleMap(title="in memory", vehicle=geometry, roles=roles),
        channels,
        {},
        0,
        trial.seconds,
    )


def _wind(rng, n, deviation, time=3.0):
    keep = np.exp(-1e-3 / time)
    kicks = deviation * np.sqrt(1 - keep**2) * rng.standard_normal(n)
    wind, x = np.empty(n), deviation * rng.standard_normal()
    for i, kick in enumerate(kicks):
        x = keep * x + kick
        wind[i] = x
    return wind


@dataclass
class _Maker:
    rng: np.random.Generator

    def told(self, role, time, value, clock):
        late = 2e-3 + self.rng.exponential(1e-4, time.size)
        offset = {"ecu": 11.0, "throttle": 5.0, "optical": 3.0}.get(clock, 8.0)
        device = np.round((time + offset) * 1e6) * 1e-6
        return Channel(role, device, value, "", clock, f"memory {role}", time + late)

    def point(self, role, out, column, period, clock, noise, quantum):
        every = slice(4 * period - 1, None, 4 * period)
        value = out[column][every]
        value = value + noise * self.rng.standard_normal(value.size)
        return self.told(role, out.time[every], np.round(value / quantum) * quantum, clock)

    def teeth(self, wheel, motorcycle, out):
        encoder = f"{wheel}_encoder"
        disc = toothed_disc(getattr(motorcycle, encoder), motorcycle.effects, encoder)
        angle, speed = out[f"{wheel}_angle"], out[f"{wheel}_speed"]
        start = begin(float(out.time[0]), float(angle[0]), float(speed[0]))
        _, passed = passing_teeth(disc, start, out.time, angle, speed)
        time = passed.ticks * disc.resolution
        return self.told(f"{wheel}_teeth", time, passed.numbers.astype(float), encoder)


TRAINING = (
    Ride("sweep", 2, 1466.0, 0.03, 0.5, 12.0, seed=11),
    Ride("square", 2, 1200.0, 0.04, 0.7, seed=12),
    Ride("multisine", 3, 1050.0, 0.035, 0.6, 14.0, seed=13),
    Ride("spark", 2, 1350.0, 0.12, 0.5, 12.0, seed=14),
)
HELD_OUT = (
    Ride("sweep", 2, 1250.0, 0.035, 0.5, 12.0, seed=21),
    Ride("multisine", 2, 1400.0, 0.03, 0.6, 12.0, seed=22),
    Ride("square", 3, 1150.0, 0.03, 0.9, seed=23),
)

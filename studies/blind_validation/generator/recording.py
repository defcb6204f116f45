"""Record a trial of a true motorcycle into a run folder."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from slipbench import dbc
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.database.database import load_database
from slipbench.protocol.recording.database_copy import copy_database
from slipbench.protocol.recording.run_folder import (
    FRAMES,
    ROLES,
    VEHICLE,
    create,
    versions,
    write_description,
)
from slipbench.studies.blind_validation.generator.excitations import BEFORE, Excitation, steady
from slipbench.studies.blind_validation.generator.fault_parameters import MotionFaults
from slipbench.studies.blind_validation.generator.frames import (
    BITRATE,
    BUS,
    MAP_ADVANCE,
    NO_TROUBLE,
    START,
    Devices,
    Line,
    candump_text,
    ecu_frames,
    on_the_bus,
    recorded,
    repeated,
    trial_frames,
)
from slipbench.studies.blind_validation.generator.instruments import (
    PERIODS,
    TEETH,
    ChannelFaults,
    Disc,
    Sensors,
    draw_clock,
    echoed,
    sampled,
    tooth_places,
    tooth_times,
)
from slipbench.studies.blind_validation.generator.physics import FRONT, WHEEL, Floats
from slipbench.studies.blind_validation.generator.ride import Commands, Course, ride
from slipbench.studies.blind_validation.generator.road import Roughness, draw_road
from slipbench.studies.blind_validation.generator.vehicle_file import Truth

TICK = 1e-3  # s
RUN_UP = 2.0  # s, ridden before the recording begins
THROTTLE_STEP, SPARK_STEP = 1e-4, np.radians(0.02)  # of the commands on the wire
CLOCKS = ("ecu", "throttle", "optical", "rear_encoder", "front_encoder")


@dataclass(frozen=True)
class FaultSet:
    """Hidden effects of a motorcycle, which its vehicle file lacks."""

    motion: MotionFaults
    sensors: Sensors


@dataclass(frozen=True)
class Trial:
    """One trial of a case. seed: of everything that chance decides in it; disc: of the teeth.

    line: what the bus repeats and the logger loses.
    """

    name: str
    excitation: Excitation
    roughness: Roughness
    seed: tuple[int, ...]
    disc: tuple[int, ...]
    line: Line = NO_TROUBLE


def course_of(
    truth: Truth, faults: FaultSet, trial: Trial, ridden_for: FaultSet | None = None
) -> tuple[Course, Commands]:
    """Simulated run of a trial; time counts from the start of the recording, after the warm-up.

    ridden_for: the faults for which start and throttle are computed, if different.
    """
    chosen = (ridden_for or faults).motion
    machine, start = steady(truth, chosen, trial.excitation)
    start = start.copy()
    start[[WHEEL, FRONT]] = np.random.default_rng((*trial.seed, 4)).uniform(0.0, 2 * np.pi, 2)
    rng = np.random.default_rng((*trial.seed, 1))
    seconds = trial.excitation.seconds
    ticks = np.arange(round((RUN_UP + seconds) / TICK))
    time: Floats = np.asarray(ticks * TICK - RUN_UP - BEFORE, np.float64)
    wave = trial.excitation.wave(time)
    throttle = np.full(ticks.size, start[0])
    spark = np.zeros(ticks.size)
    if trial.excitation.actuator == "throttle":
        throttle = throttle + wave
    else:
        spark = spark + wave
    throttle = THROTTLE_STEP * np.round(np.clip(throttle, 0.005, 1.0) / THROTTLE_STEP)
    commands = Commands(throttle, SPARK_STEP * np.round(spark / SPARK_STEP), TICK)
    road = draw_road(rng, RUN_UP + seconds, trial.roughness, machine.mass)
    origin = RUN_UP + BEFORE - 1.25  # where an analysis of the excitation begins
    whole = ride(machine, faults.motion, truth.formula, commands, road, start, origin)
    first = np.searchsorted(whole.time, RUN_UP - 0.02)
    columns = {name: column[first:] for name, column in vars(whole).items()}
    columns["time"] = columns["time"] - RUN_UP
    kept = round(RUN_UP / TICK)
    return Course(**columns), Commands(commands.throttle[kept:], commands.spark[kept:], TICK)


def channel_chance(trial: Trial, channel: str) -> np.random.Generator:
    """Random generator of one channel in a trial, independent of the other channels."""
    return np.random.default_rng((*trial.seed, 3, list(PERIODS).index(channel)))


def write_run(
    folder: Path, truth: Truth, faults: FaultSet, trial: Trial, vehicle: dict[str, Any]
) -> Path:
    """Simulate a trial and record it into a new run folder."""
    trajectory, commands = course_of(truth, faults, trial)
    excitation = trial.excitation
    database = load_database(dbc.MOTORBIKE)
    rng = np.random.default_rng((*trial.seed, 2))
    clocks = {name: draw_clock(rng) for name in CLOCKS}
    devices = Devices(database, clocks, truth.noises.latency, rng)
    hidden = faults.sensors.channels
    samples = {
        channel: sampled(
            channel,
            trajectory,
            truth.noises,
            hidden.get(channel, ChannelFaults()),
            channel_chance(trial, channel),
            truth.filters.get(channel),
        )
        for channel in PERIODS
    }
    throttle, spark = echoed(commands.throttle, commands), echoed(commands.spark, commands)
    plate, crank, optical = samples.values()
    held = commands.spark[np.clip((crank.true / TICK).astype(int), 0, commands.spark.size - 1)]
    sent = [
        ecu_frames(devices, throttle, spark.value, excitation.actuator),
        devices.message(
            "ThrottleStatus", "throttle", plate.true, position=np.clip(plate.value, 0.0, 1.0)
        ),
        devices.message(
            "EngineStatus",
            "ecu",
            crank.true,
            engine_speed=np.maximum(crank.value, 0.0),
            spark_advance=MAP_ADVANCE + held,
            gear=np.full(held.size, excitation.gear),
        ),
        devices.message(
            "OpticalSpeed",
            "optical",
            optical.true,
            speed=optical.value,
            valid=np.ones(optical.true.size, int),
        ),
        *trial_frames(devices, excitation.seconds, BEFORE, BEFORE + excitation.duration),
    ]
    for wheel in ("rear", "front"):
        disc = faults.sensors.discs.get(wheel, Disc())
        places = tooth_places(disc, np.random.default_rng((*trial.disc, wheel == "rear")))
        times, first = tooth_times(wheel, trajectory, places, truth.noises, rng)
        sent += devices.teeth(wheel, times, first)
    create(folder)
    log = on_the_bus(database, [repeated(s, trial.line, rng) for s in sent])
    log = recorded(log, trial.line, rng)
    (folder / FRAMES).write_text(candump_text(log), encoding="ascii")
    _describe(folder, trial, vehicle, database.sha256)
    return folder


def _describe(folder: Path, trial: Trial, vehicle: dict[str, Any], sha256: str) -> None:
    copy_database(dbc.MOTORBIKE, folder)
    roles = load_toml(dbc.MOTORBIKE_ROLES)
    roles["vehicle"] = {
        **roles.get("vehicle", {}),
        "rear_radius": vehicle["rear_wheel"]["radius"]["value"],
        "front_radius": vehicle["front_wheel"]["radius"]["value"],
        "teeth_per_turn": TEETH,
    }
    (folder / ROLES).write_text(tomli_w.dumps(roles), encoding="utf-8")
    (folder / VEHICLE).write_text(tomli_w.dumps(vehicle), encoding="utf-8")
    run = {
        "kind": "trial",
        "name": trial.name,
        "vehicle": vehicle["name"],
        "database_sha256": sha256,
        "start_time_ns": START,
    }
    bus = {"interface": "simulated", "name": BUS, "bitrate": int(BITRATE), "clock": "simulated"}
    write_description(folder, {"run": run, "bus": bus, "versions": versions()})

"""Randomised rides under slip control: no command of a controller makes the safety gate trip.

    python -m tests.identification.closed_loop_simulation.randomised 1000 1          # rides, seed
    python -m tests.identification.closed_loop_simulation.randomised 100 1 300  # 100 from ride 300

Each ride draws a controller, parameters within 20 %, an effect of the library that the controller
does not know, a road and a rider; every command, and the ramp of the hand-back after it, goes
through `permit` as in a tick. Trips for what the motorcycle does (slip beyond the limit, say) are
counted apart: the road made them. A ride is told by seed and number, on two processes like on one.
"""

import os
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np

from slipbench.bench.safety.permit import Held, Trip, permit
from slipbench.bench.safety.trial import Offsets, TrialState, plan_of, requested_command
from slipbench.bench.trials.excitation import plan_excitation
from slipbench.bench.trials.preparation import check_controller
from slipbench.controllers.slip_controller import from_tree
from slipbench.identification.closed_loop_simulation.compare import PARAMETERS
from slipbench.identification.closed_loop_simulation.ride import Ridden, ride
from slipbench.identification.closed_loop_simulation.scenario import Scenario, between, ramp
from slipbench.plant.effects.library import LIBRARY
from slipbench.plant.errors import PlantError
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.vehicle_file import load_vehicle
from slipbench.plant.vehicles import builtin_vehicle
from slipbench.protocol.codec.messages import ActuatorCommand, Authority, Phase, TripReason
from slipbench.protocol.configuration import read_toml
from slipbench.protocol.controller_file import ControllerFile
from slipbench.protocol.trial_file import TrialFile
from tests.bench.conditions import vehicle_state
from tests.paths import CONTROLLERS, TRIALS

BY_THE_CONTROLLER = {TripReason.AMPLITUDE, TripReason.RANGE, TripReason.RATE}
ACTUATORS = {"throttle": Authority.THROTTLE, "spark": Authority.SPARK, "mixed": Authority.BOTH}
REST = 0.10  # opening at the button; the limits count from it


def drawn_motorcycle(rng: np.random.Generator) -> Motorcycle:
    """Draw parameters within 20 % of the demonstration motorcycle's, and often an effect."""
    bike = load_vehicle(builtin_vehicle("demonstration")).motorcycle
    for owner, name in PARAMETERS:
        block = getattr(bike, owner)
        changed = replace(block, **{name: getattr(block, name) * rng.uniform(0.8, 1.2)})
        bike = replace(bike, **{owner: changed})
    has = {type(e) for e in bike.effects}
    kinds = [k for k in LIBRARY if k not in has]
    if rng.uniform() < 0.7:
        kind = kinds[int(rng.integers(len(kinds)))]
        bike = replace(bike, effects=(*bike.effects, kind.candidates()[0]))
    return bike


def drawn_scenario(rng: np.random.Generator) -> Scenario:
    """Draw target, road and rider."""
    base, size = rng.uniform(0.008, 0.03), rng.uniform(0.0, 0.004)
    at, frequency = rng.uniform(40.0, 150.0), rng.uniform(0.2, 8.0)
    return Scenario(
        "drawn",
        4.0,
        lambda t: base + size * np.sign(np.sin(2 * np.pi * frequency * t)),
        grip=between(at, at + rng.uniform(5.0, 40.0), rng.uniform(0.3, 1.0)),
        load=between(at + 20, at + 40, rng.uniform(0.4, 1.3)),
        throttle=ramp(0.5, 0.5 + rng.uniform(0.2, 1.0), rng.uniform(-0.03, 0.12)),
        engine_speed=rng.uniform(9000, 14500) * np.pi / 30,
    )


def judged(ridden: Ridden, actuator: str, trial: TrialFile, grip: float = REST) -> Trip | None:
    """Put every command before the gate; the first trip, or None. grip: at the hand-back."""
    authority, limits, start = ACTUATORS[actuator], trial.limits, 100.0
    sight = vehicle_state()
    sight = replace(
        sight,
        rider=replace(sight.rider, button=True, grip=REST),
        ecu=replace(sight.ecu, authority=authority),
        throttle=replace(sight.throttle, authority=authority),
    )
    last = ActuatorCommand(Authority.NONE, 0.0, 0.0, start - 0.001)
    for command in (*commanded(ridden, authority, start), *handed_back(ridden, trial, start, grip)):
        held = Held(REST, REST, sight.engine.gear, last, start)
        answer = permit(command, held, sight, limits, trial.command.silence)
        if isinstance(answer, Trip):
            return answer
        last = command
    return None


def commanded(ridden: Ridden, authority: Authority, start: float) -> list[ActuatorCommand]:
    """Give a ride's commands as the trial composes them, from `start` (s) on."""
    return [
        ActuatorCommand(
            authority,
            REST + throttle if authority & Authority.THROTTLE else 0.0,
            spark if authority & Authority.SPARK else 0.0,
            start + t,
        )
        for t, throttle, spark in zip(
            ridden.time.tolist(), ridden.throttle.tolist(), ridden.spark.tolist(), strict=True
        )
    ]


def handed_back(
    ridden: Ridden, trial: TrialFile, start: float, grip: float
) -> list[ActuatorCommand]:
    """Give the hand-back's ramp after the last command, as the trial's own state machine has it."""
    since = start + float(ridden.time[-1])
    left = Offsets(float(ridden.throttle[-1]), float(ridden.spark[-1]))
    state = TrialState(
        Phase.HANDING_BACK, since, throttle=REST, grip=REST, target=grip, ramp_start=left
    )
    file = read_toml(TRIALS / str(trial.controller.file), ControllerFile)  # type: ignore[union-attr]
    plan = plan_of(trial, plan_excitation(trial), file)
    ticks = round(trial.hand_back / trial.command.period)
    return [
        requested_command(state, plan, since + k * trial.command.period)
        for k in range(1, ticks + 1)
    ]


def one(number: int, seed: int) -> str:
    """Ride one; say what came of it."""
    rng = np.random.default_rng((seed, number))
    actuator = ("throttle", "spark", "mixed")[number % 3]
    trial = read_toml(TRIALS / f"slip_steps_{actuator}.toml", TrialFile)
    file = read_toml(CONTROLLERS / f"{actuator}.toml", ControllerFile)
    check_controller(file, trial, actuator)
    return outcome(file, trial, drawn_motorcycle(rng), drawn_scenario(rng), rng)


def outcome(
    file: ControllerFile,
    trial: TrialFile,
    motorcycle: Motorcycle,
    scenario: Scenario,
    rng: np.random.Generator,
) -> str:
    """Ride a scenario under a controller and put every command before the gate."""
    try:
        ridden = ride(motorcycle, scenario, from_tree(file.model_dump()), warm_up=2.5)
    except (PlantError, ValueError):
        return "cannot stand at its operating point"
    most = trial.limits.throttle_deviation
    trip = judged(ridden, file.actuator, trial, REST + rng.uniform(-most, most))
    if trip is not None:
        blamed = "the controller" if trip.reason in BY_THE_CONTROLLER else "the rig"
        return f"TRIPPED by {blamed}: {trip.reason.name}, {trip.detail}"
    return "slip beyond the limit" if np.nanmax(ridden.slip) > trial.limits.slip else "no trip"


def main() -> None:
    """Ride so many from a seed, from a number on, on two processes at most; count."""
    asked = [int(a) for a in sys.argv[1:]]
    count, seed, first = (*asked, *(1000, 1, 0)[len(asked) :])
    began, numbers = time.monotonic(), range(first, first + count)
    with ProcessPoolExecutor(min(os.cpu_count() or 1, 2)) as pool:
        found = list(pool.map(partial(one, seed=seed), numbers, chunksize=5))
    spent = time.monotonic() - began
    print(f"rides {first} to {first + count - 1} of seed {seed}, {spent:.0f} s")
    for told, number in Counter(found).most_common():
        print(f"{number:6d}  {told}")
    tripped = [n for n, told in zip(numbers, found, strict=True) if told.startswith("TRIPPED")]
    sys.exit(f"tripped: rides {tripped}" if tripped else 0)


if __name__ == "__main__":
    main()

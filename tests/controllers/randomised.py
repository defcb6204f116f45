"""Randomised rides under slip control: no command of a controller makes the safety gate trip.

    python -m tests.controllers.randomised 1000 1      # rides, seed

Each ride draws a controller, parameters within 20 %, an effect of the library that the controller
does not know, a road and a rider; every command goes through `permit` as in a tick. Trips for what
the motorcycle does (slip beyond the limit, say) are counted apart: the road made them.
"""

import sys
from collections import Counter
from dataclasses import replace

import numpy as np

from bench.permit import Held, Trip, permit
from controllers.slip_controller import from_tree
from identification.rehearsal.compare import PARAMETERS
from identification.rehearsal.ride import Ridden, ride
from identification.rehearsal.scenario import Scenario, between, ramp
from plant.effects.library import LIBRARY
from plant.motorcycle import Motorcycle
from plant.trouble import PlantError
from plant.vehicle_file import builtin_vehicle, load_vehicle
from protocol.configuration import read_toml
from protocol.controller_file import ControllerFile
from protocol.messages import ActuatorCommand, Authority, TripReason
from protocol.trial_file import TrialFile
from tests.bench.conditions import TRIALS, seen

BY_THE_CONTROLLER = {TripReason.AMPLITUDE, TripReason.RANGE, TripReason.RATE}
ACTUATORS = {
    "throttle": Authority.THROTTLE, "spark": Authority.SPARK, "mixed": Authority.BOTH
}  # fmt: skip
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
        "drawn", 4.0, lambda t: base + size * np.sign(np.sin(2 * np.pi * frequency * t)),
        grip=between(at, at + rng.uniform(5.0, 40.0), rng.uniform(0.3, 1.0)),
        load=between(at + 20, at + 40, rng.uniform(0.4, 1.3)),
        throttle=ramp(0.5, 0.5 + rng.uniform(0.2, 1.0), rng.uniform(-0.03, 0.12)),
        engine_speed=rng.uniform(9000, 14500) * np.pi / 30,
    )  # fmt: skip


def judged(ridden: Ridden, actuator: str, trial: TrialFile) -> Trip | None:
    """Put every command before the gate; the first trip, or None."""
    authority, limits, start = ACTUATORS[actuator], trial.limits, 100.0
    sight = seen()
    sight = replace(
        sight, rider=replace(sight.rider, button=True),
        ecu=replace(sight.ecu, authority=authority),
        throttle=replace(sight.throttle, authority=authority),
    )  # fmt: skip
    last = ActuatorCommand(Authority.NONE, 0.0, 0.0, start - 0.001)
    for t, throttle, spark in zip(ridden.time, ridden.throttle, ridden.spark, strict=True):
        command = ActuatorCommand(
            authority, REST + float(throttle) if authority & Authority.THROTTLE else 0.0,
            float(spark) if authority & Authority.SPARK else 0.0, start + float(t),
        )  # fmt: skip
        held = Held(REST, sight.rider.grip, sight.engine.gear, last, start)
        answer = permit(command, held, sight, limits, trial.command.silence)
        if isinstance(answer, Trip):
            return answer
        last = command
    return None


def one(seed: int, number: int) -> str:
    """Ride one; say what came of it."""
    rng = np.random.default_rng((seed, number))
    actuator = ("throttle", "spark", "mixed")[number % 3]
    trial = read_toml(TRIALS / f"slip_steps_{actuator}.toml", TrialFile)
    file = read_toml(TRIALS / "controllers" / f"{actuator}.toml", ControllerFile)
    try:
        ridden = ride(drawn_motorcycle(rng), drawn_scenario(rng), from_tree(file.model_dump()))
    except (PlantError, ValueError):
        return "cannot stand at its operating point"
    trip = judged(ridden, actuator, trial)
    if trip is not None:
        return f"TRIPPED by the controller: {trip.reason.name}, {trip.detail}"
    return "slip beyond the limit" if np.nanmax(ridden.slip) > trial.limits.slip else "no trip"


def main() -> None:
    """Ride so many from a seed and count."""
    count, seed = (int(a) for a in (*sys.argv[1:], "1000", "1")[:2])
    found = Counter(one(seed, number) for number in range(count))
    for outcome, number in found.most_common():
        print(f"{number:6d}  {outcome}")
    sys.exit(any(o.startswith("TRIPPED") for o in found))


if __name__ == "__main__":
    main()

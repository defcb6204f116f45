"""Open loop, throttle, spark and mixed side by side: the same scenarios, one table.

Where the rider drives hard, a controller may only take away: its limits end at the rider's wish.
Steps and tracking of the target are free both ways.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from slipbench.controllers.slip_controller import SlipController, from_tree
from slipbench.identification.closed_loop_simulation.measures import (
    calm,
    error,
    mean_retard,
    time_lost,
)
from slipbench.identification.closed_loop_simulation.ride import TICK, Ridden, ride
from slipbench.identification.closed_loop_simulation.scenario import (
    Scenario,
    crest,
    launch,
    rolling_on,
    slip_step,
    tracking,
    wet_patch,
    wet_road,
)
from slipbench.identification.response.following import (
    StepMeasures,
    step_measures,
    tracking_bandwidth,
)
from slipbench.plant.effects.library import LIBRARY
from slipbench.plant.equilibrium import equilibrium
from slipbench.plant.errors import PlantError
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Inputs
from slipbench.plant.simulation import Simulation
from slipbench.protocol.controller_file import ControllerFile

HARD = 0.10  # opening that the rider adds to cruising
OVER = 0.20  # that a dry tyre cannot carry at its target slip
WET = 0.06  # that a wet one cannot carry, and a controller's range can take away
TARGETS = (0.015, 0.02, 0.025, 0.03, 0.04, 0.05, 0.06)  # slip, of which the quickest is the best
STEPS = 21.0  # s, a step each
SEEDS = (1, 2, 3, 4, 5)  # of the optical sensor's noise, for steps and tracking
CAUGHT = 0.03  # slip at which a controller takes away
SHARE = 0.2  # of a parameter, either way
PARAMETERS = (
    ("engine", "torque_scale"),
    ("engine", "inertia"),
    ("driveline", "stiffness"),
    ("driveline", "damping"),
    ("tyre", "slip_stiffness"),
    ("tyre", "friction"),
    ("body", "mass"),
    ("throttle_servo", "natural_frequency"),
    ("intake", "filling_time"),
)
Progress = Callable[[str], None]


@dataclass(frozen=True)
class Compared:
    """What one controller does; NaN where it is not asked (open loop follows no target)."""

    name: str
    bandwidth: float  # Hz, mean over the seeds
    reach: tuple[float, float]  # Hz, least and greatest of them
    overshoot: float
    settling: float  # s
    noise: float  # of a step
    peaks: Mapping[str, float]  # slip, by scenario
    lost: float  # s, rolling on on the wet road, behind the best constant slip
    retard: Mapping[str, float]  # rad, mean, by scenario
    errors: Mapping[str, float]  # slip, by scenario
    parameters: tuple[int, int]  # stable, tried
    effects: tuple[int, int]
    unstable: tuple[str, ...]


def controllers_of(files: Mapping[str, ControllerFile]) -> dict[str, SlipController | None]:
    """Make controllers from their files, open loop first."""
    return {"open loop": None} | {n: from_tree(f.model_dump()) for n, f in files.items()}


def taking_away(file: ControllerFile) -> SlipController:
    """Return the controller that may only close the throttle and retard the spark."""
    tree = file.model_dump()
    tree["limits"]["high"] = 0.0
    if tree.get("mixed"):
        tree["mixed"]["throttle"]["high"] = 0.0
    tree["governor"] = None
    return from_tree(tree)


def compare(
    motorcycle: Motorcycle, files: Mapping[str, ControllerFile], say: Progress = lambda _: None
) -> tuple[list[Compared], dict[str, dict[str, Ridden]]]:
    """Ride every scenario with every controller. Returns figures, and rides by scenario."""
    base = resting_slip(motorcycle)
    hard = [
        wet_patch(CAUGHT, HARD),
        crest(CAUGHT, HARD),
        rolling_on(CAUGHT, OVER),
        launch(CAUGHT, OVER),
        wet_road(CAUGHT, WET),
    ]
    following = [slip_step(base, duration=STEPS), tracking(base)]
    rides: dict[str, dict[str, Ridden]] = {}
    for scenario in (*following, *hard):
        rides[scenario.name] = {}
        for name, controller in controllers_of(files).items():
            if controller is None and scenario in following:
                continue  # nobody follows
            say(f"{scenario.name}: {name}")
            if controller is not None and scenario in hard:
                controller = taking_away(files[name])
            rides[scenario.name][name] = ride(motorcycle, scenario, controller)
    seeds = {s.name: _seeded(motorcycle, s, files, rides[s.name], say) for s in following}
    best = quickest(motorcycle, files, say)
    found = [
        _compared(motorcycle, name, files.get(name), rides, seeds, best, say)
        for name in controllers_of(files)
    ]
    return found, rides


def _seeded(
    motorcycle: Motorcycle,
    scenario: Scenario,
    files: Mapping[str, ControllerFile],
    first: Mapping[str, Ridden],
    say: Progress,
) -> dict[str, list[Ridden]]:
    """Ride a scenario again with other noise. first: the rides of the first seed."""
    found = {name: [first[name]] for name in files}
    for name, file in files.items():
        for seed in SEEDS[1:]:
            say(f"{scenario.name}, seed {seed}: {name}")
            found[name].append(ride(motorcycle, scenario, from_tree(file.model_dump()), seed))
    return found


def quickest(motorcycle: Motorcycle, files: Mapping[str, ControllerFile], say: Progress) -> Ridden:
    """Ride the wet road at one constant slip after the other, with every controller."""
    rides = []
    for name, file in files.items():
        for target in TARGETS:
            say(f"wet road, {100 * target:g} %: {name}")
            rides.append(ride(motorcycle, wet_road(target, WET), taking_away(file)))
    return max(rides, key=lambda r: float(r.distance[-1]))


def resting_slip(motorcycle: Motorcycle, scenario: Scenario | None = None) -> float:
    """Slip of the steady ride."""
    at = scenario or slip_step(0.0)
    simulation = Simulation(motorcycle)
    state, rest = equilibrium(simulation, at.gear, at.engine_speed)
    _, out = simulation.advance(state, Inputs.held(50, gear=float(at.gear), throttle_command=rest))
    return float(out.slip[-1])


def _compared(
    motorcycle: Motorcycle,
    name: str,
    file: ControllerFile | None,
    rides: Mapping[str, Mapping[str, Ridden]],
    seeds: Mapping[str, Mapping[str, list[Ridden]]],
    best: Ridden,
    say: Progress,
) -> Compared:
    nan = float("nan")
    mine = {scenario: by_name[name] for scenario, by_name in rides.items() if name in by_name}
    retard = {scenario: mean_retard(r) for scenario, r in mine.items()}
    reached, step = [nan], StepMeasures(nan, nan, nan)
    if file:
        steps, swept = seeds["slip step"][name], seeds["slip tracking"][name]
        target, slip = (
            np.concatenate([getattr(r, of) for r in steps]) for of in ("target", "slip")
        )
        step = step_measures(target, slip, TICK) or step
        reached = [tracking_bandwidth(r.target, r.slip, 1 / TICK) for r in swept]
        retard |= {s: float(np.mean([mean_retard(r) for r in seeds[s][name]])) for s in seeds}
    good, tried, bad = _robust(_varied(motorcycle), file, say)
    kept, missing, worse = _robust(_with_effects(motorcycle), file, say)
    return Compared(
        name,
        float(np.mean(reached)),
        (min(reached), max(reached)),
        step.overshoot,
        step.settling,
        step.noise,
        {s: float(r.slip.max()) for s, r in mine.items()},
        time_lost(mine["wet road"], best),
        retard,
        {s: error(r, 1.0) for s, r in mine.items()},
        (good, tried),
        (kept, missing),
        (*bad, *worse),
    )


def _robust(
    motorcycles: Mapping[str, Motorcycle], file: ControllerFile | None, say: Progress
) -> tuple[int, int, tuple[str, ...]]:
    """Count the motorcycles on which steps of the target stay calm."""
    if file is None:
        return 0, 0, ()
    bad, tried = [], 0
    for name, motorcycle in motorcycles.items():
        say(f"{file.name}: {name}")
        try:
            ridden = ride(
                motorcycle,
                slip_step(resting_slip(motorcycle), duration=4.0),
                from_tree(file.model_dump()),
                warm_up=2.5,
            )
        except (PlantError, ValueError):
            continue  # such a motorcycle cannot hold the operating point at all
        tried += 1
        if not calm(ridden.slip[np.isfinite(ridden.slip)]):
            bad.append(name)
    return tried - len(bad), tried, tuple(bad)


def _varied(motorcycle: Motorcycle) -> dict[str, Motorcycle]:
    found = {}
    for owner, name in PARAMETERS:
        block = getattr(motorcycle, owner)
        for factor in (1.0 - SHARE, 1.0 + SHARE):
            changed = replace(block, **{name: getattr(block, name) * factor})
            found[f"{owner}.{name} x {factor:g}"] = replace(motorcycle, **{owner: changed})
    return found


def _with_effects(motorcycle: Motorcycle) -> dict[str, Motorcycle]:
    """Every effect of the library that the motorcycle lacks, at its typical size."""
    has = {type(effect) for effect in motorcycle.effects}
    found = {}
    for kind in (k for k in LIBRARY if k not in has):
        try:
            effect = kind.candidates()[0]
            found[effect.key] = replace(motorcycle, effects=(*motorcycle.effects, effect))
        except PlantError:
            continue
    return found

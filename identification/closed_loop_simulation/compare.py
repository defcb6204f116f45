"""Comparison of controllers in closed-loop simulation: the same scenarios for each.

In scenarios with high throttle a controller may only reduce torque: its upper limit is the rider's
command. In setpoint steps and tracking it may act in both directions.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from slipbench.controllers.slip_controller import SlipController, from_tree
from slipbench.identification.closed_loop_simulation.measures import (
    decays,
    error,
    mean_retard,
    time_lost,
)
from slipbench.identification.closed_loop_simulation.reducing import reducing_only
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

HARD = 0.10  # throttle opening that the rider adds to cruising
OVER = 0.20  # opening that exceeds the grip of a dry tyre at the slip setpoint
WET = 0.06  # opening that exceeds the grip of a wet tyre, within the range of a controller
TARGETS = (
    0.015,
    0.02,
    0.025,
    0.03,
    0.04,
    0.05,
    0.06,
)  # constant slips; the fastest one is the reference
STEPS = 21.0  # s, one step per second
SEEDS = (1, 2, 3, 4, 5)  # of the optical sensor's noise, for steps and tracking
CAUGHT = 0.03  # slip above which a controller reduces torque
SHARE = 0.2  # relative change of a parameter, both signs
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
    """Results of one controller; NaN where not applicable (open loop tracks no setpoint)."""

    name: str
    bandwidth: float  # Hz, mean over the seeds
    bandwidths: tuple[float, float]  # Hz, minimum and maximum over the seeds
    overshoot: float
    settling: float  # s
    noise: float  # share of the step height
    peaks: Mapping[str, float]  # slip, by scenario
    lost: float  # s behind the best constant slip, wet road
    retard: Mapping[str, float]  # rad, mean, by scenario
    errors: Mapping[str, float]  # slip, by scenario
    parameters: tuple[int, int]  # stable, simulated
    effects: tuple[int, int]
    unstable: tuple[str, ...]


def controllers_of(files: Mapping[str, ControllerFile]) -> dict[str, SlipController | None]:
    """Controllers by name; None for open loop, which is first."""
    return {"open loop": None} | {n: from_tree(f.model_dump()) for n, f in files.items()}


def compare(
    motorcycle: Motorcycle, files: Mapping[str, ControllerFile], report: Progress = lambda _: None
) -> tuple[list[Compared], dict[str, dict[str, Ridden]]]:
    """Results by controller, and simulated rides by scenario and controller."""
    base = resting_slip(motorcycle)
    hard = [
        wet_patch(CAUGHT, HARD),
        crest(CAUGHT, HARD),
        rolling_on(CAUGHT, OVER),
        launch(CAUGHT, OVER),
        wet_road(CAUGHT, WET),
    ]
    tracked = [slip_step(base, duration=STEPS), tracking(base)]
    rides: dict[str, dict[str, Ridden]] = {}
    for scenario in (*tracked, *hard):
        rides[scenario.name] = {}
        for name, controller in controllers_of(files).items():
            if controller is None and scenario in tracked:
                continue  # no tracking in open loop
            report(f"{scenario.name}: {name}")
            if controller is not None and scenario in hard:
                controller = reducing_only(files[name])
            rides[scenario.name][name] = ride(motorcycle, scenario, controller)
    seeds = {s.name: _seeded(motorcycle, s, files, rides[s.name], report) for s in tracked}
    best = fastest(motorcycle, files, report)
    found = [
        _compared(motorcycle, name, files.get(name), rides, seeds, best, report)
        for name in controllers_of(files)
    ]
    return found, rides


def _seeded(
    motorcycle: Motorcycle,
    scenario: Scenario,
    files: Mapping[str, ControllerFile],
    first: Mapping[str, Ridden],
    report: Progress,
) -> dict[str, list[Ridden]]:
    """Rides of a scenario with other noise seeds, by controller. first: those of the first seed."""
    found = {name: [first[name]] for name in files}
    for name, file in files.items():
        for seed in SEEDS[1:]:
            report(f"{scenario.name}, seed {seed}: {name}")
            found[name].append(ride(motorcycle, scenario, from_tree(file.model_dump()), seed))
    return found


def fastest(
    motorcycle: Motorcycle, files: Mapping[str, ControllerFile], report: Progress
) -> Ridden:
    """Fastest ride on the wet road over all constant slip setpoints and controllers."""
    rides = []
    for name, file in files.items():
        for target in TARGETS:
            report(f"wet road, {100 * target:g} %: {name}")
            rides.append(ride(motorcycle, wet_road(target, WET), reducing_only(file)))
    return max(rides, key=lambda r: float(r.distance[-1]))


def resting_slip(motorcycle: Motorcycle, scenario: Scenario | None = None) -> float:
    """Slip in steady state at the operating point of a scenario."""
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
    report: Progress,
) -> Compared:
    nan = float("nan")
    mine = {scenario: by_name[name] for scenario, by_name in rides.items() if name in by_name}
    retard = {scenario: mean_retard(r) for scenario, r in mine.items()}
    bandwidths, step = [nan], StepMeasures(nan, nan, nan)
    if file:
        steps, swept = seeds["slip step"][name], seeds["slip tracking"][name]
        target, slip = (
            np.concatenate([getattr(r, of) for r in steps]) for of in ("target", "slip")
        )
        step = step_measures(target, slip, TICK) or step
        bandwidths = [tracking_bandwidth(r.target, r.slip, 1 / TICK) for r in swept]
        retard |= {s: float(np.mean([mean_retard(r) for r in seeds[s][name]])) for s in seeds}
    good, evaluated, bad = _robust(_varied(motorcycle), file, report)
    kept, missing, worse = _robust(_with_effects(motorcycle), file, report)
    return Compared(
        name,
        float(np.mean(bandwidths)),
        (min(bandwidths), max(bandwidths)),
        step.overshoot,
        step.settling,
        step.noise,
        {s: float(r.slip.max()) for s, r in mine.items()},
        time_lost(mine["wet road"], best),
        retard,
        {s: error(r, 1.0) for s, r in mine.items()},
        (good, evaluated),
        (kept, missing),
        (*bad, *worse),
    )


def _robust(
    motorcycles: Mapping[str, Motorcycle], file: ControllerFile | None, report: Progress
) -> tuple[int, int, tuple[str, ...]]:
    """Stable, simulated, and names of the unstable motorcycle variants for setpoint steps."""
    if file is None:
        return 0, 0, ()
    bad, evaluated = [], 0
    for name, motorcycle in motorcycles.items():
        report(f"{file.name}: {name}")
        try:
            ridden = ride(
                motorcycle,
                slip_step(resting_slip(motorcycle), duration=4.0),
                from_tree(file.model_dump()),
                warm_up=2.5,
            )
        except (PlantError, ValueError):
            continue  # this variant has no equilibrium at the operating point
        evaluated += 1
        if not decays(ridden.slip[np.isfinite(ridden.slip)]):
            bad.append(name)
    return evaluated - len(bad), evaluated, tuple(bad)


def _varied(motorcycle: Motorcycle) -> dict[str, Motorcycle]:
    found = {}
    for owner, name in PARAMETERS:
        component = getattr(motorcycle, owner)
        for factor in (1.0 - SHARE, 1.0 + SHARE):
            changed = replace(component, **{name: getattr(component, name) * factor})
            found[f"{owner}.{name} x {factor:g}"] = replace(motorcycle, **{owner: changed})
    return found


def _with_effects(motorcycle: Motorcycle) -> dict[str, Motorcycle]:
    """Variants with each effect of the library that the motorcycle lacks, at typical magnitude."""
    has = {type(effect) for effect in motorcycle.effects}
    found = {}
    for kind in (k for k in LIBRARY if k not in has):
        try:
            effect = kind.candidates()[0]
            found[effect.key] = replace(motorcycle, effects=(*motorcycle.effects, effect))
        except PlantError:
            continue
    return found

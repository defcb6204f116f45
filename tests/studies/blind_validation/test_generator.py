"""The generator is honest: the vehicle file means the same on both sides, and secrets act."""

import copy
import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from slipbench.plant.effects.library import BY_NAME
from slipbench.plant.signals import Inputs
from slipbench.plant.simulation import Simulation
from slipbench.plant.vehicle_file import load_vehicle
from slipbench.studies.blind_validation.generator import physics as p
from slipbench.studies.blind_validation.generator.case import draw_case, secret_of
from slipbench.studies.blind_validation.generator.excitations import steady
from slipbench.studies.blind_validation.generator.fault_parameters import MotionFaults
from slipbench.studies.blind_validation.generator.fault_types import (
    LIBRARY,
    OUTSIDE,
    FaultType,
    Hidden,
    draw_hidden,
)
from slipbench.studies.blind_validation.generator.instruments import Sensors
from slipbench.studies.blind_validation.generator.recording import FaultSet, course_of
from slipbench.studies.blind_validation.generator.ride import Course
from slipbench.studies.blind_validation.generator.road import Roughness
from slipbench.studies.blind_validation.generator.tyres import NAMES, force
from slipbench.studies.blind_validation.generator.vehicle_file import FIELDS

SEED = 5
STILL = Roughness(0.0, 2.0, 0.0, 1e-12, 1e-12, 1e-12)
NONE = FaultSet(MotionFaults(), Sensors())
MOVING = [k for k in (*LIBRARY, *OUTSIDE) if not k.subjects]
COLUMNS = {
    "plate": "throttle",
    "crank_speed": "engine_speed",
    "wheel_speed": "rear_speed",
    "front_speed": "front_speed",
    "optical": "optical_speed",
}


@pytest.mark.parametrize("number", [0, 1, 3], ids=["sweep", "blips", "spark"])
def test_with_the_true_numbers_both_programs_ride_alike(tmp_path: Path, number: int) -> None:
    case = next(c for c in (draw_case(SEED, n) for n in range(9)) if c.truth.formula == 0)
    truth, trial = case.truth, replace(case.training[number], roughness=STILL)
    course, commands = course_of(truth, NONE, trial)
    bike = load_vehicle(_truly_told(case, tmp_path / "true.toml")).motorcycle
    _, start = steady(truth, MotionFaults(), trial.excitation)
    lead = 2000
    simulation = Simulation(bike)
    state = simulation.state(
        throttle=start[p.PLATE],
        air=start[p.AIR],
        throttle_command=start[p.PLATE],
        engine_speed=start[p.CRANK_SPEED],
        rear_speed=start[p.WHEEL_SPEED],
        speed=start[p.SPEED],
        twist=start[p.TWIST],
    )
    inputs = Inputs.held(
        lead + commands.throttle.size,
        gear=float(trial.excitation.gear),
        throttle_command=np.concatenate((np.full(lead, commands.throttle[0]), commands.throttle)),
        spark=np.concatenate((np.zeros(lead), commands.spark)),
    )
    _, out = simulation.advance(state, inputs)
    time = out.time - lead * 1e-3
    inside = (time > 0.2) & (time < 11.9)
    for mine, theirs in COLUMNS.items():
        told = np.interp(time[inside], course.time, getattr(course, mine))
        simulated = out[theirs][inside]
        assert np.std(told - simulated) < 1e-3 * np.std(simulated) + 1e-6, mine


def _truly_told(case, path: Path) -> Path:
    tree = copy.deepcopy(dict(case.vehicle))
    for name, (block, parameter, *_) in FIELDS.items():
        tree[block][parameter]["value"] = getattr(case.truth.machine, name)
    for i, ratio in enumerate(case.truth.gears, start=1):
        tree["gears"][str(i)]["value"] = ratio
    path.write_text(tomli_w.dumps(tree), encoding="utf-8")
    return path


@pytest.mark.parametrize("formula", range(len(NAMES)), ids=NAMES)
def test_every_tyre_has_the_slope_and_the_peak_that_it_is_given(formula: int) -> None:
    C, D = 40e3, 1800.0
    slope = force(formula, 1e-6, C, D, 1.5) / 1e-6
    highest = max(force(formula, s, C, D, 1.5) for s in np.linspace(0.0, 3.0, 2000))
    assert slope == pytest.approx(C, rel=1e-3)
    assert highest == pytest.approx(D, rel=0.06)
    assert force(formula, -0.02, C, D, 1.5) == -force(formula, 0.02, C, D, 1.5)


@cache
def plain(name: str) -> Course:
    case = draw_case(SEED, 0)
    trial = next(t for t in case.training if t.name == name)
    return course_of(case.truth, NONE, replace(trial, roughness=STILL))[0]


@pytest.mark.parametrize("kind", MOVING, ids=[k.name for k in MOVING])
def test_what_is_missing_acts_and_stays_finite(kind: FaultType) -> None:
    case = draw_case(SEED, 0)
    hidden = draw_hidden(np.random.default_rng(SEED), kind, "moderate")
    trial = replace(case.training[3 if "spark" in kind.name else 1], roughness=STILL)
    with_it, _ = course_of(case.truth, secret_of((hidden,)), trial)
    without = plain(trial.name)
    for column in COLUMNS:
        assert np.all(np.isfinite(getattr(with_it, column)))
    moved = [np.max(np.abs(getattr(with_it, c) - getattr(without, c))) for c in COLUMNS]
    # Worn plates hold at what this trial asks of them; wear takes kilometres.
    assert max(moved) > 0.0 or kind.needs


def test_there_are_enough_kinds_and_the_library_has_them_or_has_not() -> None:
    assert len(LIBRARY) >= 30
    assert len(OUTSIDE) >= 6
    assert {k.name for k in LIBRARY} <= set(BY_NAME)
    assert not {k.name for k in OUTSIDE} & set(BY_NAME)


@pytest.mark.parametrize("kind", LIBRARY, ids=[k.name for k in LIBRARY])
def test_sizes_mean_what_the_library_means(kind: FaultType) -> None:
    described = {p.name: p for p in BY_NAME[kind.name].parameters()}
    assert set(kind.sizes) | set(kind.shapes) <= set(described)
    for name, (_, small, typical) in kind.sizes.items():
        page = described[name]
        absent = 0.0 if math.isinf(page.absent) else page.absent
        assert page.low <= min(small, typical)
        assert max(small, typical) <= page.high
        assert page.smallest is not None, name
        assert abs(small - absent) == pytest.approx(abs(page.smallest - absent), rel=0.01)


def test_drawing_again_gives_the_same_case() -> None:
    assert draw_case(SEED, 7) == draw_case(SEED, 7)


def test_a_vehicle_file_errs_as_much_as_it_says() -> None:
    print(f"seed {SEED}")
    misses = total = 0
    for number in range(60):
        case = draw_case(SEED, number)
        if case.truth.formula:
            continue
        for name, (block, parameter, *_) in FIELDS.items():
            told = case.vehicle[block][parameter]
            error = abs(math.log(getattr(case.truth.machine, name) / told["value"]))
            misses += error > told["plus_minus"] / told["value"]
            total += 1
    assert 0.02 < misses / total < 0.08


def test_hidden_things_are_called_as_a_verdict_would() -> None:
    assert Hidden("channel_lag", "small", "engine_speed", {}).key == "channel_lag.engine_speed"
    assert Hidden("backlash", "small", "", {}).key == "backlash"

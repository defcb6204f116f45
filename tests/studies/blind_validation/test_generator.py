"""The generator is honest: the vehicle file means the same on both sides, and secrets act."""

import copy
import math
from collections import Counter
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
from slipbench.studies.blind_validation.generator.fault_type import FaultType
from slipbench.studies.blind_validation.generator.fault_types import LIBRARY, Hidden, draw_hidden
from slipbench.studies.blind_validation.generator.filters import LAG
from slipbench.studies.blind_validation.generator.instruments import ChannelFaults, Sensors, sampled
from slipbench.studies.blind_validation.generator.outside import OUTSIDE
from slipbench.studies.blind_validation.generator.recording import FaultSet, course_of
from slipbench.studies.blind_validation.generator.ride import Course
from slipbench.studies.blind_validation.generator.road import Roughness, draw_road
from slipbench.studies.blind_validation.generator.tyres import NAMES, force
from slipbench.studies.blind_validation.generator.vehicle_file import FIELDS, NORMAL_95

SEED = 5
STILL = Roughness(wind=0.0, grade=0.0, bump=1e-12, shake=1e-12, combustion=1e-12)
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
    inside = (time > 0.2) & (time < trial.excitation.seconds - 0.1)
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
    assert len(OUTSIDE) >= 20
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


def _errors(careless: bool) -> np.ndarray:
    """Errors of stated numbers in their standard deviations, over many cases, shape (n,)."""
    print(f"seed {SEED}")
    found = []
    for number in range(200):
        case = draw_case(SEED, number)
        if case.careless != careless or case.truth.formula:
            continue
        for name, (block, parameter, *_) in FIELDS.items():
            stated = case.vehicle[block][parameter]
            error = math.log(getattr(case.truth.machine, name) / stated["value"])
            found.append(error / (stated["plus_minus"] / stated["value"]) * NORMAL_95)
    return np.array(found)


def test_a_vehicle_file_errs_as_much_as_it_says() -> None:
    errors = _errors(careless=False)
    assert errors.size > 1000
    assert np.std(errors) == pytest.approx(1.0, abs=0.05)
    assert 0.03 < np.mean(np.abs(errors) > NORMAL_95) < 0.07


def test_a_careless_file_errs_up_to_three_deviations_in_a_tenth_of_the_cases() -> None:
    errors = _errors(careless=True)
    assert 2.8 < np.max(np.abs(errors)) < 3.001
    assert np.std(errors) == pytest.approx(math.sqrt(3.0), rel=0.1)
    assert 10 <= sum(draw_case(SEED, n).careless for n in range(200)) <= 32


def test_half_of_the_cases_have_another_tyre_formula_and_each_formula_occurs() -> None:
    found = Counter(draw_case(SEED, n).truth.formula for n in range(200))
    assert 80 <= 200 - found[0] <= 120
    assert set(found) == set(range(len(NAMES)))


def test_winds_and_grades_are_as_slow_as_the_recording_is_long() -> None:
    """The correlation time of what was drawn is that which was asked for; times reach 1 to 12 s."""
    times = [draw_case(SEED, n).training[0].roughness.wind_time for n in range(60)]
    assert min(times) < 1.5
    assert max(times) > 8.0
    for time in (1.0, 8.0):
        rough = Roughness(wind=1.0, wind_time=time, grade=0.0, shake=1e-12)
        wind = draw_road(np.random.default_rng(SEED), 4000.0, rough, 240.0).wind[::100]
        lag = round(time / 0.1)
        slow = 1.0 / 1.09  # the share of the slow gusts in the variance
        assert np.mean(wind[lag:] * wind[:-lag]) / np.var(wind) == pytest.approx(
            slow * math.exp(-1.0), abs=0.08
        )


def test_filters_are_stated_exactly_and_never_where_an_effect_of_the_sensor_is_hidden() -> None:
    stated = 0
    for number in range(100):
        case = draw_case(SEED, number)
        effects = {e["channel"]: e for e in case.vehicle.get("effects", ())}
        for channel, own in case.truth.filters.items():
            assert channel not in {h.subject for h in case.hidden}
            latency = case.vehicle["channels"][channel]["latency"]["value"]
            delay = (
                effects[channel]["time_constant"]["value"] if own.kind == LAG else latency - 2e-3
            )
            assert delay == pytest.approx(own.group_delay)
            stated += 1
    assert 90 < stated < 180


@cache
def ridden_with(name: str, **values: float) -> Course:
    case = draw_case(SEED, 0)
    trial = next(t for t in case.training if t.name == name)
    faults = FaultSet(MotionFaults(**values), Sensors())
    return course_of(case.truth, faults, replace(trial, roughness=STILL))[0]


@pytest.mark.parametrize(
    "values",
    [
        {"cold_drag": 4.0, "oil_time": 2.0},
        {"torque_drift": -0.06},
        {"tuck": -0.15, "tuck_time": 3.0},
        {"brake_drag": 14.0, "brake_way": 100.0},
    ],
    ids=["cold oil", "drift", "rider", "brake"],
)
def test_effects_over_the_whole_record_act_in_each_half_of_it(values: dict[str, float]) -> None:
    with_it, without = ridden_with("training_2", **values), plain("training_2")
    change, middle = with_it.speed - without.speed, without.time.size // 2
    moved = np.ptp(change)
    assert moved > 0.05  # m/s
    for half in (change[:middle], change[middle:]):
        assert np.ptp(half) > 0.15 * moved


def test_a_drifting_scale_grows_in_proportion_to_time() -> None:
    case, course = draw_case(SEED, 0), plain("training_2")
    silent = replace(case.truth.noises, optical=0.0)
    shown, true = (
        sampled("optical_speed", course, silent, faults, np.random.default_rng(SEED))
        for faults in (ChannelFaults(drift=0.02), ChannelFaults())
    )
    assert shown.value / true.value - 1.0 == pytest.approx(2e-3 * true.true, abs=1e-9)


def test_kinds_with_memory_are_marked_and_half_of_all_kinds_have_none() -> None:
    """A static effect changes no quantity behind it when it has gone: hysteresis and delays do."""
    memory = {k.name for k in (*LIBRARY, *OUTSIDE) if k.memory}
    assert {"backlash", "throttle_stiction", "air_box_delay", "channel_lag", "squat"} <= memory
    assert not {"radius_growth", "spark_clip", "driveline_loss", "ram_air"} & memory
    assert all(name in BY_NAME for k in OUTSIDE for name in k.near)


def test_hidden_things_are_called_as_a_verdict_would() -> None:
    assert Hidden("channel_lag", "small", "engine_speed", {}).key == "channel_lag.engine_speed"
    assert Hidden("backlash", "small", "", {}).key == "backlash"

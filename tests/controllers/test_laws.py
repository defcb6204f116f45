"""Laws of every controller: bounded, never wound up, equal after a reset, no jump at the start."""

import math
from copy import deepcopy
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from slipbench.controllers.compensator import Compensator
from slipbench.controllers.governor import Governor
from slipbench.controllers.internal_model import InternalModel
from slipbench.controllers.limits import Range
from slipbench.controllers.linear import Linear, in_series
from slipbench.controllers.pid import Pid
from slipbench.controllers.schedule import Schedule
from slipbench.controllers.slip_controller import SlipController, from_tree
from slipbench.controllers.two_actuators import TwoActuators
from slipbench.identification.design.prefilter import Prefilter
from slipbench.protocol.configuration import load_toml, read_toml
from slipbench.protocol.controller_file import ControllerFile
from tests.paths import CONTROLLERS

DT = 0.001
LIMITS = Range(-0.1, 0.2, 6.0)
GAIN, SLOW = 0.2, 0.03  # slip per unit of throttle; time constant, s


def pid(proportional: float = 1.5, integral: float = 60.0) -> Pid:
    return Pid(proportional, integral, 0.01, LIMITS)


def internal_model(limits: Range = LIMITS, delay: int = 18, close: float = 0.02) -> InternalModel:
    """Model g / (1 + T s) behind a delay, inverse (1 + T s) / (g (1 + close s))."""
    a, f = math.exp(-DT / SLOW), math.exp(-DT / close)
    model = Linear(np.array([[a]]), np.array([GAIN * (1 - a)]), np.array([1.0]), 0.0)
    # (z - a) (1 - f) / ((z - f) (1 - a) g)
    ratio = (1 - f) / ((1 - a) * GAIN)
    inverse = Linear(np.array([[f]]), np.array([1.0]), np.array([ratio * (f - a)]), ratio)
    return InternalModel(model, inverse, delay, DT, limits)


def compensator() -> Compensator:
    """Integral, lead and a lag, as a synthesis leaves them."""
    shaping = in_series(((0.9, -0.8, 0.0, -0.85, 0.0), (1.0, 0.1, 0.0, -0.6, 0.0)))
    return Compensator(30.0, shaping, DT, LIMITS, 0.05)


def from_file(name: str) -> Any:
    """A law of the project's own, its range that of these tests; of a mixed one the spark's."""
    law: Any = from_tree(load_toml(CONTROLLERS / f"{name}.toml")).law
    return replace(law, limits=LIMITS)


H_INFINITY = [
    pytest.param(from_file(name), id=name) for name in ("throttle_h_infinity", "spark_h_infinity")
]
FILES = sorted(path.stem for path in (CONTROLLERS).glob("*.toml"))
FROM_FILES = [pytest.param(from_file(name), id=name) for name in FILES]
LAWS = [
    pytest.param(pid(), id="pid"),
    pytest.param(internal_model(), id="internal model"),
    pytest.param(compensator(), id="compensator"),
]
values = st.floats(-1.0, 1.0)
slips = st.lists(st.one_of(st.just(math.nan), values), min_size=1, max_size=60)


def run(law, state, reference, measurements, dt=DT):
    commands = []
    for y in measurements:
        command, state = law.update(state, reference, y, dt)
        commands.append(command)
    return commands, state


def closed_loop(law, reference, seconds, start=0.0, late=18, disturbance=lambda _: 0.0):
    """Slip of the first-order motorcycle under a law, and its commands."""
    x, line, state = 0.0, [0.0] * late, law.start(start, 0.0, 0.0)
    slip, commands = [], []
    for k in range(round(seconds / DT)):
        y = x + disturbance(k * DT)
        command, state = law.update(state, reference, y, DT)
        line.append(command)
        x += DT / SLOW * (GAIN * line.pop(0) - x)
        slip.append(y)
        commands.append(command)
    return np.array(slip), np.array(commands)


@pytest.mark.parametrize("law", LAWS + H_INFINITY)
@given(start=st.floats(-0.1, 0.2), reference=values, measurements=slips)
def test_a_command_stays_in_its_range_and_moves_no_faster_than_allowed(
    law, start, reference, measurements
):
    commands, _ = run(law, law.start(start, reference, measurements[0]), reference, measurements)
    assert all(LIMITS.low <= c <= LIMITS.high for c in commands)
    steps = np.abs(np.diff([start, *commands]))
    assert np.all(steps <= LIMITS.rate * DT * (1 + 1e-9))


@pytest.mark.parametrize("law", LAWS + H_INFINITY)
@given(start=st.floats(-0.1, 0.2), reference=values, measurement=values)
def test_taking_over_does_not_jump(law, start, reference, measurement):
    command, _ = law.update(law.start(start, reference, measurement), reference, measurement, DT)
    assert command == pytest.approx(start, abs=1e-9)


def noisy(slip: float, noise: float, seed: int) -> list[float]:
    """Slip with sensor noise, each sample held for 5 ms, 0.3 s."""
    told = slip + noise * np.random.default_rng(seed).standard_normal(60)
    return [float(y) for y in np.repeat(told, 5)]


WIDE = {"low": -1e3, "high": 1e3, "rate": 1e6}
noises = st.sampled_from([0.0, 1e-5, 1e-4, 4e-4])
errors = st.floats(0.005, 0.06)
sides = st.sampled_from([-1, 1])
seeds = st.integers(0, 1000)


@pytest.mark.parametrize("law", [*LAWS, *FROM_FILES])
@given(side=sides, error=errors, noise=noises, seed=seeds)
def test_an_error_that_pushes_into_a_limit_leaves_the_command_there(law, side, error, noise, seed):
    """Started at the limit, it never leaves it by more than the noise alone moves a free law."""
    limit, told = (LIMITS.high if side > 0 else LIMITS.low), noisy(0.01, noise, seed)
    free = replace(law, limits=Range(**WIDE))
    alone, _ = run(free, free.start(0.0, 0.01, told[0]), 0.01, told)
    target = 0.01 + side * error
    commands, _ = run(law, law.start(limit, target, told[0]), target, told)
    assert np.max(np.abs(np.array(commands) - limit)) <= np.max(np.abs(alone)) + 1e-12


@pytest.mark.parametrize("name", FILES)
@given(side=sides, error=errors, noise=noises, seed=seeds)
def test_a_target_beyond_what_may_be_given_moves_neither_throttle_nor_spark(
    name, side, error, noise, seed
):
    """Prefilter and all: who may only take away does not while the slip is below its target."""
    told = noisy(0.01 if side > 0 else 0.08, noise, seed)
    ends = {"high": 0.0} if side > 0 else {"low": 0.0}
    held = offsets(controller(name, ends), told[0] + side * error, told)
    alone = offsets(controller(name, WIDE), told[0], told)
    assert np.all(np.max(np.abs(held), axis=0) <= np.max(np.abs(alone), axis=0) + 1e-12)


@cache
def file_tree(name: str) -> dict[str, Any]:
    return read_toml(CONTROLLERS / f"{name}.toml", ControllerFile).model_dump()


def controller(name: str, ends: dict[str, float]) -> SlipController:
    """A controller of the project's own, without governor, its ranges changed."""
    tree = deepcopy(file_tree(name)) | {"governor": None}
    tree["limits"] |= ends
    if tree["mixed"]:
        tree["mixed"]["throttle"] |= ends
    return from_tree(tree)


def offsets(law: SlipController, target: float, told: list[float]) -> np.ndarray:
    """Throttle and spark, (n, 2), from rest under a constant target."""
    state, found = law.start(0.0, 0.0, told[0], 53.0), []
    for slip in told:
        throttle, spark, state = law.update(state, target, slip, 53.0, DT)
        found.append((throttle, spark))
    return np.array(found)


@pytest.mark.parametrize("law", LAWS + H_INFINITY)
@given(measurements=slips)
def test_a_reset_equals_a_new_one(law, measurements):
    """Laws keep nothing of their own: what came before does not matter."""
    once, _ = run(law, law.start(0.05, 0.01, 0.01), 0.01, measurements)
    run(law, law.start(-0.05, 0.3, 0.0), 0.3, [0.9] * 20)
    assert run(law, law.start(0.05, 0.01, 0.01), 0.01, measurements)[0] == once


@pytest.mark.parametrize("law", LAWS + H_INFINITY)
def test_a_wall_of_a_second_and_one_of_a_minute_are_left_alike(law):
    """No windup: how long a target was out of reach does not change how the command comes back."""
    back = []
    for seconds in (2.0, 60.0):
        _, state = run(law, law.start(0.0, 0.0, 0.0), 1.0, [0.0] * round(seconds / DT))
        assert state.command == pytest.approx(LIMITS.high)
        back.append(run(law, state, -0.02, [0.0] * 300)[0])
    np.testing.assert_allclose(back[0], back[1], atol=1e-3)


@pytest.mark.parametrize("law", [pytest.param(pid(0.8, 30.0), id="pid"), *LAWS[1:]])
@pytest.mark.parametrize("reference", [0.004, -0.01, 0.02])
def test_the_error_vanishes(law, reference):
    slip, _ = closed_loop(law, reference, 3.0)
    assert slip[-1] == pytest.approx(reference, abs=1e-5)


def test_the_internal_model_answers_with_its_filter_and_the_delay_alone():
    slip, _ = closed_loop(internal_model(Range(-1.0, 1.0)), 0.01, 0.3)
    t = np.arange(slip.size) * DT
    ideal = 0.01 * (1 - np.exp(-np.maximum(t - 19 * DT, 0) / 0.02))
    assert np.max(np.abs(slip - ideal)) < 0.0006  # explicit Euler against the exact step


@pytest.mark.parametrize("law", LAWS + H_INFINITY)
def test_an_unknown_slip_holds_the_command(law):
    _, state = run(law, law.start(0.05, 0.01, 0.01), 0.01, [0.01] * 50)
    held = state.command
    commands, _ = run(law, state, 0.01, [math.nan] * 50)
    assert max(abs(c - held) for c in commands) < 1e-6


@pytest.mark.parametrize("law", LAWS + H_INFINITY)
def test_an_unknown_slip_holds_the_command_while_a_disturbance_is_held_off(law):
    """What the controller does against a slope of the road must not be undone by a silence."""
    state = law.start(0.05, 0.01, 0.01)
    commands, state = run(law, state, 0.01, [0.012] * 40)
    held, state = run(law, state, 0.01, [math.nan] * 20)
    assert set(held) == {commands[-1]}
    on, _ = run(law, state, 0.01, [0.012] * 5)
    assert np.max(np.abs(np.array(on) - commands[-1])) < 0.02


@given(st.floats(0.0, 80.0))
def test_gains_between_two_speeds_lie_between_their_designs(speed):
    schedule = Schedule(((20.0, pid()), (60.0, pid(3.0, 20.0))))
    at = schedule.at(speed)
    assert 1.5 <= at.proportional <= 3.0
    assert 20.0 <= at.integral <= 60.0
    assert abs(schedule.at(speed + 1e-6).proportional - at.proportional) < 1e-6


G_T, G_S, SERVO, LATER = 0.2, 0.05, 0.02, 12  # slip per command; s; periods
SPARK, THROTTLE = Range(-0.2, 0.2, 20.0), Range(-0.3, 0.3, 2.0)
FREE = Range(-10.0, 10.0, 1e4)


def mixed(
    spark: Range = SPARK, throttle: Range = THROTTLE, zone: float = 0.0, scale: float = 1.0
) -> TwoActuators:
    """Spark behind the slip's lag alone, throttle behind a servo and a delay as well.

    scale: of the models' gains against the motorcycle of `mixed_loop`.
    """
    a, b = math.exp(-DT / SERVO), math.exp(-DT / SLOW)
    servo = (1 - a, 0.0, 0.0, -a, 0.0)
    slip_t, slip_s = ((0.0, scale * g * (1 - b), 0.0, -b, 0.0) for g in (G_T, G_S))
    slow = InternalModel(
        in_series((servo, slip_t)),
        in_series((_lead(a, 0.03, 1.0), _lead(b, 0.03, scale * G_T))),
        LATER,
        DT,
        throttle,
    )
    fast = InternalModel(
        in_series((slip_s,)), in_series((_lead(b, 0.015, scale * G_S),)), 0, DT, spark
    )
    return TwoActuators(slow, fast, in_series((servo,)), LATER, zone, G_S / G_T)


def _lead(pole: float, close: float, gain: float) -> tuple[float, ...]:
    """(1 - pole / z) / gain over a lag of `close` s, steady gain 1 / gain."""
    f = math.exp(-DT / close)
    quick = (1 - f) / (1 - pole) / gain
    return (quick, -pole * quick, 0.0, -f, 0.0)


def mixed_loop(law, seconds, reference=lambda _: 0.0, disturbance=lambda _: 0.0):
    """Slip, throttle and spark of the first-order motorcycle under a mixed law."""
    a, b = math.exp(-DT / SERVO), math.exp(-DT / SLOW)
    servo, x, line, found = 0.0, 0.0, [0.0] * LATER, []
    state = law.start(0.0, 0.0, 0.0, 0.0)
    for k in range(round(seconds / DT)):
        y = x + disturbance(k * DT)
        throttle, spark, state = law.update(state, reference(k * DT), y, DT)
        line.append(throttle)
        servo = a * servo + (1 - a) * line.pop(0)
        x = b * x + (1 - b) * (G_T * servo + G_S * spark)
        found.append((y, throttle, spark))
    return np.array(found).T


def late_step(t):
    return 0.004 if t > 0.5 else 0.0


def test_mixed_spark_returns_to_its_optimum_and_the_throttle_holds_the_slip():
    slip, throttle, spark = mixed_loop(mixed(), 2.0, disturbance=late_step)
    assert abs(slip[-1]) < 1e-5
    assert spark.min() < -0.02
    assert abs(spark[-1]) < 1e-4
    assert throttle[-1] == pytest.approx(-0.004 / G_T, rel=0.01)


def test_mixed_is_as_quick_as_its_spark_alone():
    """With the true model the throttle changes nothing about the slip: the loop is the spark's."""
    law = mixed(FREE, FREE)
    slip, _, _ = mixed_loop(law, 1.5, disturbance=late_step)
    x, b, alone, state = 0.0, math.exp(-DT / SLOW), [], law.spark.start(0.0, 0.0, 0.0)
    for k in range(1500):
        y = x + late_step(k * DT)
        spark, state = law.spark.update(state, 0.0, y, DT)
        x = b * x + (1 - b) * G_S * spark
        alone.append(y)
    np.testing.assert_allclose(slip, alone, atol=1e-9)


def test_a_target_that_the_throttle_can_make_leaves_the_spark_alone():
    slip, throttle, spark = mixed_loop(mixed(throttle=FREE), 1.5, reference=late_step)
    assert np.max(np.abs(spark)) < 1e-9
    assert slip[-1] == pytest.approx(0.004, rel=1e-3)
    assert throttle[-1] == pytest.approx(0.004 / G_T, rel=1e-3)


def test_a_target_beyond_the_throttle_is_reached_by_both_and_left_unwound():
    """How long it lasted does not matter after."""
    back = []
    for seconds in (1.0, 5.0):
        slip, throttle, spark = mixed_loop(
            mixed(), seconds + 1.0, reference=lambda t, s=seconds: 0.065 if t < s else 0.0
        )
        there = round(seconds / DT) - 1
        assert slip[there] == pytest.approx(0.065, abs=2e-4)
        assert throttle[there] == pytest.approx(0.3)
        assert spark[there] == pytest.approx(0.1, abs=5e-3)
        back.append(slip[-1000:])
    np.testing.assert_allclose(back[0], back[1], atol=3e-4)


def test_what_the_dead_zone_explains_moves_the_throttle_alone():
    slip, throttle, spark = mixed_loop(mixed(zone=0.2), 2.0, disturbance=late_step)
    assert np.all(spark == 0.0)
    assert abs(slip[-1]) < 1e-5
    assert throttle[-1] == pytest.approx(-0.004 / G_T, rel=0.01)


@pytest.mark.parametrize("scale", [0.8, 1.25])
@pytest.mark.parametrize("zone", [0.0, 0.02])
def test_models_that_are_wrong_by_a_fifth_still_bring_the_slip_to_its_target(scale, zone):
    slip, _, spark = mixed_loop(mixed(zone=zone, scale=scale), 4.0, late_step, late_step)
    assert slip[-1] == pytest.approx(0.004, rel=1e-3)
    assert abs(spark[-1]) < 1e-4


@given(
    throttle=st.floats(-0.3, 0.3), spark=st.floats(-0.2, 0.2), measurements=slips, reference=values
)
def test_mixed_keeps_both_ranges_and_takes_over_without_a_jump(
    throttle, spark, measurements, reference
):
    law = mixed(zone=0.01)
    state = law.start(throttle, spark, reference, reference)
    first = law.update(state, reference, reference, DT)
    assert first[:2] == (pytest.approx(throttle, abs=1e-9), pytest.approx(spark, abs=1e-9))
    last = (throttle, spark)
    for y in measurements:
        new = law.update(state, reference, y, DT)
        if math.isnan(y):
            assert new[:2] == last
        assert -0.3 <= new[0] <= 0.3
        assert -0.2 <= new[1] <= 0.2
        assert abs(new[0] - last[0]) <= 2.0 * DT + 1e-12
        assert abs(new[1] - last[1]) <= 20.0 * DT + 1e-9
        last, state = new[:2], new[2]


def test_a_reset_mixed_controller_equals_a_new_one():
    law, found = mixed(zone=0.01), []
    for before in (0, 300):
        state = law.start(0.1, -0.05, 0.3, 0.0)
        for _ in range(before):
            *_, state = law.update(state, 0.3, 0.9, DT)
        state, commands = law.start(0.05, 0.0, 0.01, 0.01), []
        for k in range(200):
            throttle, spark, state = law.update(state, 0.01, 0.01 + 0.02 * math.sin(0.1 * k), DT)
            commands.append((throttle, spark))
        found.append(commands)
    assert found[0] == found[1]


def test_a_controller_begins_when_the_slip_is_known():
    controller = SlipController(
        "throttle", pid(0.8, 30.0), Governor(Range(0.0, 0.05, 0.5), GAIN, LIMITS)
    )
    state = controller.start(0.0, 0.0, math.nan, 50.0)
    throttle, _, state = controller.update(state, 0.01, math.nan, 50.0, DT)
    assert throttle == 0.0
    for _ in range(50):
        throttle, _, state = controller.update(state, 0.03, 0.01, 50.0, DT)
    assert throttle > 0.0


def test_a_prefilter_passes_what_lasts_and_starts_at_rest():
    """A target that stays is followed exactly, with a prefilter or without."""
    section = Prefilter((4.0, 0.5), (8.0, 1.0), DT).section
    calm = SlipController("throttle", pid(0.8, 30.0), prefilter=in_series((section,)))
    state = calm.start(0.01, 0.0, 0.012, 50.0)
    throttle, _, state = calm.update(state, 0.012, 0.012, 50.0, DT)
    assert throttle == pytest.approx(0.01, abs=1e-9)
    for _ in range(1000):
        _, _, state = calm.update(state, 0.02, 0.012, 50.0, DT)
    p = calm.prefilter
    assert float(p.C @ state.passed) + p.D * 0.02 == pytest.approx(0.02, abs=1e-9)


@given(st.lists(st.floats(-0.2, 0.2), min_size=1, max_size=40), st.floats(-0.1, 0.2))
@example([0.0] * 20, 0.125)  # the last step once ended below zero by rounding
def test_the_governor_asks_for_nothing_that_the_actuator_cannot_give(targets, command):
    governor = Governor(Range(0.0, 0.05, 0.5), 0.2, LIMITS)
    r = 0.01
    for target in targets:
        new = governor.update(r, target, command, DT)
        assert 0.0 <= new <= 0.05
        assert abs(new - r) <= 0.5 * DT + 1e-12
        assert LIMITS.low - 1e-9 <= command + (new - r) / 0.2 <= LIMITS.high + 1e-9
        r = new


@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(1e-4, 0.1))
def test_nothing_leaves_its_range_faster_than_its_rate(wanted, last, dt):
    got = LIMITS.towards(wanted, last, dt)
    assert abs(got - last) <= LIMITS.rate * dt + 1e-12
    assert abs(got - LIMITS.nearest(got)) <= abs(last - LIMITS.nearest(last)) + 1e-12

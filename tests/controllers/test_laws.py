"""Laws of every controller: bounded, never wound up, equal after a reset, no jump at the start."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers.governor import Governor
from controllers.internal_model import InternalModel
from controllers.limits import Range
from controllers.linear import Linear
from controllers.mid_ranging import MidRanging
from controllers.pid import Pid
from controllers.schedule import Schedule

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


LAWS = [pytest.param(pid(), id="pid"), pytest.param(internal_model(), id="internal model")]
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


@pytest.mark.parametrize("law", LAWS)
@given(start=st.floats(-0.1, 0.2), reference=values, measurements=slips)
def test_a_command_stays_in_its_range_and_moves_no_faster_than_allowed(
    law, start, reference, measurements
):
    commands, _ = run(law, law.start(start, reference, measurements[0]), reference, measurements)
    assert all(LIMITS.low <= c <= LIMITS.high for c in commands)
    steps = np.abs(np.diff([start, *commands]))
    assert np.all(steps <= LIMITS.rate * DT * (1 + 1e-9))


@pytest.mark.parametrize("law", LAWS)
@given(start=st.floats(-0.1, 0.2), reference=values, measurement=values)
def test_taking_over_does_not_jump(law, start, reference, measurement):
    command, _ = law.update(law.start(start, reference, measurement), reference, measurement, DT)
    assert command == pytest.approx(start, abs=1e-9)


@pytest.mark.parametrize("law", LAWS)
@given(measurements=slips)
def test_a_reset_equals_a_new_one(law, measurements):
    """Laws keep nothing of their own: what came before does not matter."""
    once, _ = run(law, law.start(0.05, 0.01, 0.01), 0.01, measurements)
    run(law, law.start(-0.05, 0.3, 0.0), 0.3, [0.9] * 20)
    assert run(law, law.start(0.05, 0.01, 0.01), 0.01, measurements)[0] == once


@pytest.mark.parametrize("law", LAWS)
def test_a_wall_of_a_second_and_one_of_a_minute_are_left_alike(law):
    """No windup: how long a target was out of reach does not change how the command comes back."""
    back = []
    for seconds in (2.0, 60.0):
        _, state = run(law, law.start(0.0, 0.0, 0.0), 1.0, [0.0] * round(seconds / DT))
        assert state.command == pytest.approx(LIMITS.high)
        back.append(run(law, state, -0.02, [0.0] * 300)[0])
    np.testing.assert_allclose(back[0], back[1], atol=1e-3)


@pytest.mark.parametrize("law", [pytest.param(pid(0.8, 30.0), id="pid"), LAWS[1]])
@pytest.mark.parametrize("reference", [0.004, -0.01, 0.02])
def test_the_error_vanishes(law, reference):
    slip, _ = closed_loop(law, reference, 3.0)
    assert slip[-1] == pytest.approx(reference, abs=1e-5)


def test_the_internal_model_answers_with_its_filter_and_the_delay_alone():
    slip, _ = closed_loop(internal_model(Range(-1.0, 1.0)), 0.01, 0.3)
    t = np.arange(slip.size) * DT
    ideal = 0.01 * (1 - np.exp(-np.maximum(t - 19 * DT, 0) / 0.02))
    assert np.max(np.abs(slip - ideal)) < 0.0006  # explicit Euler against the exact step


@pytest.mark.parametrize("law", LAWS)
def test_an_unknown_slip_holds_the_command(law):
    _, state = run(law, law.start(0.05, 0.01, 0.01), 0.01, [0.01] * 50)
    held = state.command
    commands, _ = run(law, state, 0.01, [math.nan] * 50)
    assert max(abs(c - held) for c in commands) < 1e-6


@given(st.floats(0.0, 80.0))
def test_gains_between_two_speeds_lie_between_their_designs(speed):
    schedule = Schedule(((20.0, pid()), (60.0, pid(3.0, 20.0))))
    at = schedule.at(speed)
    assert 1.5 <= at.proportional <= 3.0
    assert 20.0 <= at.integral <= 60.0
    assert abs(schedule.at(speed + 1e-6).proportional - at.proportional) < 1e-6


def test_mixed_spark_returns_to_its_optimum_and_the_throttle_holds_the_slip():
    """Slip = g_t throttle + g_s spark + disturbance: spark answers first and then rests."""
    g_t, g_s = 0.2, 0.05
    spark_law = Pid(2.0, 150.0, 0.0, Range(-0.2, 0.07, 20.0))
    law = MidRanging(spark_law, Range(-0.3, 0.3, 2.0), g_s / g_t, 0.3)
    state, y, sparks = law.start(0.0, 0.0, 0.0, 0.0), 0.0, []
    for k in range(4000):
        throttle, spark, state = law.update(state, 0.0, y, DT)
        target = g_t * throttle + g_s * spark + (0.004 if k > 500 else 0.0)
        y += DT / SLOW * (target - y)
        sparks.append(spark)
    assert abs(y) < 1e-5
    assert min(sparks) < -0.02
    assert abs(sparks[-1]) < 1e-3
    assert throttle == pytest.approx(-0.004 / g_t, rel=0.05)


@given(st.lists(st.floats(-0.2, 0.2), min_size=1, max_size=40), st.floats(-0.1, 0.2))
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

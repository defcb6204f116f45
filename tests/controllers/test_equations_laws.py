"""Each law is the equation at the head of its file: compared with scipy's filters, not with itself."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from slipbench.controllers.compensator import Compensator
from slipbench.controllers.internal_model import InternalModel
from slipbench.controllers.limits import Range
from slipbench.controllers.linear import Linear, in_series
from slipbench.controllers.pid import Pid
from slipbench.controllers.two_actuators import TwoActuators, reach

DT = 0.001
FREE, LIMITED = Range(-1e3, 1e3, 1e9), Range(-0.1, 0.2, 1e9)
SECTIONS = ((0.9, -0.8, 0.0, -0.85, 0.0), (1.0, 0.1, 0.05, -0.6, 0.08))
PID = Pid(1.5, 60.0, 0.02, FREE, 0.004, 0.03, 0.7)
COMPENSATOR = Compensator(30.0, in_series(SECTIONS), DT, FREE, 0.05)
POLE, FILTER, GAIN = math.exp(-DT / 0.03), math.exp(-DT / 0.02), 0.2


def internal_model(limits: Range = FREE, delay: int = 7) -> InternalModel:
    """Model of gain 0.2 behind a lag of 30 ms and a delay; inverse with a lag of 20 ms."""
    model = Linear(np.array([[POLE]]), np.array([GAIN * (1 - POLE)]), np.array([1.0]), 0.0)
    ratio = (1 - FILTER) / ((1 - POLE) * GAIN)
    inverse = in_series(((ratio, -ratio * POLE, 0.0, -FILTER, 0.0),))
    return InternalModel(model, inverse, delay, DT, limits)


def two_actuators(throttle: Range = FREE, spark: Range = FREE, zone: float = 0.0) -> TwoActuators:
    later = in_series(((1 - POLE, 0.0, 0.0, -POLE, 0.0),))
    return TwoActuators(internal_model(throttle), internal_model(spark, 3), later, 4, zone, 0.25)


LAWS = [
    pytest.param(PID, id="pid"),
    pytest.param(COMPENSATOR, id="compensator"),
    pytest.param(internal_model(), id="internal model"),
]
RNG = np.random.default_rng(7)  # seed 7
REFERENCES = 0.02 + 0.01 * RNG.standard_normal(80)
SLIPS = 0.015 + 0.01 * RNG.standard_normal(80)


def run(law, state, references, slips, dt=DT):
    commands = []
    for r, y in zip(references, slips, strict=True):
        command, state = law.update(state, float(r), float(y), dt)
        commands.append(command)
    return np.array(commands), state


def held_integral(error, start):
    """Euler's rule: the integral that a command uses knows the errors before it."""
    return start + DT * np.concatenate(([0.0], np.cumsum(error)[:-1]))


def test_pid_is_the_equation_of_the_textbook():
    """The derivative by the implicit Euler rule: D (T_f + dt) = T_f D_before - K_d (y - before)."""
    commands, _ = run(PID, PID.start(0.05, REFERENCES[0], SLIPS[0]), REFERENCES, SLIPS)
    direct = 1.5 * (0.7 * REFERENCES - SLIPS)
    integral = 60.0 * held_integral(REFERENCES - SLIPS, 0.0) + 0.05 - direct[0]
    moved = np.diff(SLIPS, prepend=SLIPS[0])
    slope = signal.lfilter([-0.02], [0.004 + DT, -0.004], moved)
    np.testing.assert_allclose(commands, direct + integral + slope, rtol=1e-12, atol=1e-12)


def shaped(error):
    """SECTIONS by scipy, from the state that a constant first error leaves."""
    rows = np.array([(b0, b1, b2, 1.0, a1, a2) for b0, b1, b2, a1, a2 in SECTIONS])
    out, _ = signal.sosfilt(rows, error, zi=signal.sosfilt_zi(rows) * error[0])
    return out


def test_a_compensator_is_its_filter_and_an_integral():
    start = COMPENSATOR.start(0.05, REFERENCES[0], SLIPS[0])
    commands, _ = run(COMPENSATOR, start, REFERENCES, SLIPS)
    error = REFERENCES - SLIPS
    filtered = shaped(error)
    integral = 30.0 * held_integral(error, 0.0) + 0.05 - filtered[0]
    np.testing.assert_allclose(commands, filtered + integral, rtol=1e-9, atol=1e-12)


def test_internal_model_control_is_its_equation():
    """u = Q (r - (y - G u)), all from where it started; at first r = y."""
    law = internal_model()
    r, y = REFERENCES.copy(), SLIPS.copy()
    r[0] = y[0]
    commands, _ = run(law, law.start(0.05, r[0], y[0]), r, y)
    u = commands - 0.05
    late = np.concatenate((np.zeros(7), u))[: u.size]
    lag = signal.lfilter([0.0, GAIN * (1 - POLE)], [1.0, -POLE], late)
    error = r - y[0] - (y - y[0] - lag)
    ratio = (1 - FILTER) / ((1 - POLE) * GAIN)
    wanted = signal.lfilter([ratio, -ratio * POLE], [1.0, -FILTER], error)
    np.testing.assert_allclose(u, wanted, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_where_slip_and_command_are_counted_from_does_not_matter(law):
    """Linear laws: other rest points shift the commands by as much and change nothing else."""
    law = replace(law, reference_weight=1.0) if isinstance(law, Pid) else law
    found = [
        run(law, law.start(c, REFERENCES[0] + s, SLIPS[0] + s), REFERENCES + s, SLIPS + s)[0] - c
        for c, s in ((0.0, 0.0), (0.4, 0.03))
    ]
    np.testing.assert_allclose(found[0], found[1], atol=1e-9)


@pytest.mark.parametrize("law", LAWS[1:])
@pytest.mark.parametrize("factor", [0.2, 2.8, 5.0])
def test_a_longer_step_is_so_many_of_the_laws_own(law, factor):
    many = max(round(factor), 1)
    start = law.start(0.05, REFERENCES[0], SLIPS[0])
    once, _ = run(law, start, REFERENCES, SLIPS, factor * DT)
    each, _ = run(law, start, np.repeat(REFERENCES, many), np.repeat(SLIPS, many))
    np.testing.assert_array_equal(once, each[many - 1 :: many])


@pytest.mark.parametrize("law", LAWS[:2])
@pytest.mark.parametrize("side", [1, -1])
def test_at_a_limit_the_integral_stands_a_tracking_time_of_error_beyond_it(law, side):
    """I' = K_i e + (u_limited - u) / T_t = 0."""
    law, error = replace(law, limits=LIMITED), side * 0.04
    state = law.start(0.0, 0.0, 0.0)
    _, state = run(law, state, [error] * 2000, [0.0] * 2000)
    limit = LIMITED.high if side > 0 else LIMITED.low
    assert state.command == limit
    rest = 1.5 * 0.7 if isinstance(law, Pid) else law.shaping.gain
    beyond = state.integral + rest * error - limit
    assert beyond == pytest.approx(law.integral * error * law.tracking_time, rel=1e-6)


@pytest.mark.parametrize("law", LAWS[:2])
def test_what_the_actuators_cut_counts_as_what_the_limits_cut(law):
    """Tracking: a free law that is given cut commands keeps the integral of a limited one."""
    limited, start = replace(law, limits=LIMITED), law.start(0.1, 0.0, 0.0)
    ours, theirs = start, start
    for r, y in zip(4 * REFERENCES, SLIPS, strict=True):
        _, ours = limited.update(ours, float(r), float(y), DT)
        command, theirs = law.update(theirs, float(r), float(y), DT)
        theirs = law.given(theirs, LIMITED.nearest(command), DT)
        assert theirs.integral == pytest.approx(ours.integral, rel=1e-9)
    assert ours.command == LIMITED.high


@pytest.mark.parametrize("law", LAWS[:2])
def test_a_tracking_time_shorter_than_a_step_tracks_in_one(law):
    """No overshoot: the integral is at most set to what the limit allows."""
    quick = replace(law, limits=LIMITED, tracking_time=DT / 7)
    state = quick.start(0.2, 0.0, 0.0)
    _, after = quick.update(state, 0.05, 0.0, DT)
    free = replace(law, limits=FREE)
    wanted, _ = free.update(state, 0.05, 0.0, DT)
    expected = state.integral + law.integral * 0.05 * DT + 0.2 - wanted
    assert after.integral == pytest.approx(expected, rel=1e-12)
    tracked = quick.given(state, 0.05, DT)
    assert tracked.integral == pytest.approx(state.integral + 0.05 - 0.2, rel=1e-12)


def test_what_the_actuators_did_not_give_is_no_disturbance():
    """A true model and half of each command given: the law hears no surprise, and answers none."""
    law, rng = internal_model(), np.random.default_rng(3)  # seed 3
    share = rng.uniform(0.2, 1.0, REFERENCES.size)
    x, line, state = 0.0, [0.0] * 7, law.start(0.3, 0.1, 0.1)
    commands = []
    for r, part in zip(REFERENCES, share, strict=True):
        command, state = law.update(state, float(r) + 0.1, x + 0.1, DT)
        commands.append(command - 0.3)
        state = law.given(state, 0.3 + part * (command - 0.3), DT)
        line.append(part * (command - 0.3))
        x = POLE * x + GAIN * (1 - POLE) * line.pop(0)
    ratio = (1 - FILTER) / ((1 - POLE) * GAIN)
    alone = signal.lfilter([ratio, -ratio * POLE], [1.0, -FILTER], REFERENCES)
    np.testing.assert_allclose(commands, alone, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_a_start_at_an_unknown_slip_takes_the_target_for_it(law):
    state = law.start(0.05, 0.01, math.nan)
    command, _ = law.update(state, 0.01, 0.01, DT)
    assert command == pytest.approx(0.05, abs=1e-12)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("unknown", [math.nan, math.inf])
def test_what_is_unknown_holds_the_command_and_an_integral(law, unknown):
    _, state = run(law, law.start(0.05, 0.01, 0.01), REFERENCES, SLIPS)
    command, after = law.update(state, 0.01, unknown, DT)
    assert command == after.command == state.command
    if hasattr(state, "integral"):
        assert after.integral == state.integral


def test_after_an_unknown_slip_a_derivative_begins_anew():
    _, state = run(PID, PID.start(0.05, 0.01, 0.01), REFERENCES, SLIPS)
    assert state.slope != 0.0
    _, after = PID.update(state, 0.01, math.nan, DT)
    assert after.slope == 0.0
    assert after.measurement == state.measurement


@pytest.mark.parametrize("name", ["filter_time", "tracking_time"])
@pytest.mark.parametrize("value", [0.0, -0.01, math.nan])
def test_a_pid_without_positive_times_is_refused(name, value):
    with pytest.raises(ValueError, match=name):
        replace(PID, **{name: value})
    replace(PID, **{name: 1e-9})


@pytest.mark.parametrize("value", [0.0, -0.01, math.nan])
def test_a_compensator_without_a_positive_tracking_time_is_refused(value):
    with pytest.raises(ValueError, match="tracking_time"):
        replace(COMPENSATOR, tracking_time=value)
    replace(COMPENSATOR, tracking_time=1e-9)


def test_a_model_that_responds_at_once_is_refused():
    """Its response to the command that it decides would be part of the measurement before it."""
    law = internal_model()
    with pytest.raises(ValueError, match="strictly proper"):
        replace(law, model=replace(law.model, D=0.01))


@pytest.mark.parametrize("share", [-0.5, 0.0, 0.25, 0.5, 1.0])
def test_a_controller_between_two_has_gains_on_a_line_and_all_else_of_the_first(share):
    other = Pid(3.5, 20.0, 0.06, LIMITED, 0.1, 0.2, 0.1)
    at, s = PID.between(other, share), max(share, 0.0)
    assert at.proportional == pytest.approx(1.5 + s * 2.0)
    assert at.integral == pytest.approx(60.0 - s * 40.0)
    assert at.derivative == pytest.approx(0.02 + s * 0.04)
    assert replace(at, proportional=1.5, integral=60.0, derivative=0.02) == PID


def superposed(law, references, slips, start=(0.0, 0.0), level=0.0):
    state, found = law.start(*start, level, level), []
    for r, y in zip(references + level, slips + level, strict=True):
        throttle, spark, state = law.update(state, float(r), float(y), DT)
        found.append((throttle - start[0], spark - start[1]))
    return np.array(found)


def test_two_actuators_without_limits_are_linear_about_any_rest_point():
    law = two_actuators()
    whole = superposed(law, REFERENCES, SLIPS)
    parts = superposed(law, REFERENCES, 0 * SLIPS) + superposed(law, 0 * REFERENCES, SLIPS)
    np.testing.assert_allclose(whole, parts, atol=1e-9)
    np.testing.assert_allclose(
        superposed(law, REFERENCES, SLIPS, (0.2, -0.1), 0.03), whole, atol=1e-9
    )


def test_two_actuators_are_their_equations():
    """d = y - G_t theta - G_s s; theta = Q_t (r - d); s = Q_s (-d) - M (theta - theta_r) / k."""
    throttle, spark = superposed(two_actuators(), REFERENCES, SLIPS).T
    lag = ([0.0, GAIN * (1 - POLE)], [1.0, -POLE])
    t_late, s_late = (
        np.concatenate((np.zeros(n), u))[: u.size] for n, u in ((7, throttle), (3, spark))
    )
    d = SLIPS - signal.lfilter(*lag, t_late) - signal.lfilter(*lag, s_late)
    ratio = (1 - FILTER) / ((1 - POLE) * GAIN)
    q = ([ratio, -ratio * POLE], [1.0, -FILTER])
    target = signal.lfilter(*q, REFERENCES)
    np.testing.assert_allclose(throttle, target - signal.lfilter(*q, d), atol=1e-9)
    relief = np.concatenate((np.zeros(4), throttle - target))[: throttle.size] / 0.25
    done = signal.lfilter([1 - POLE], [1.0, -POLE], relief)
    np.testing.assert_allclose(spark, -signal.lfilter(*q, d) - done, atol=1e-9)


@pytest.mark.parametrize("factor", [0.2, 2.8])
def test_a_longer_step_of_two_actuators_is_so_many_of_their_own(factor):
    law, many = two_actuators(), max(round(factor), 1)
    once, each = (law.start(0.1, -0.1, 0.01, 0.01),) * 2
    for r, y in zip(REFERENCES, SLIPS, strict=True):
        *commands, once = law.update(once, float(r), float(y), factor * DT)
        for _ in range(many):
            *singles, each = law.update(each, float(r), float(y), DT)
        assert commands == singles


def test_two_actuators_start_at_an_unknown_slip_without_a_jump():
    law = two_actuators()
    throttle, spark, _ = law.update(law.start(0.1, -0.1, 0.01, math.nan), 0.01, 0.01, DT)
    assert (throttle, spark) == (pytest.approx(0.1), pytest.approx(-0.1))


def test_two_actuators_start_about_the_slip_that_was_measured():
    law = two_actuators()
    state = law.start(0.03, -0.02, 0.05, 0.02)
    assert state.base == (0.03, -0.02, 0.02)
    np.testing.assert_array_equal(state.target, law.throttle.start(0.03, 0.05, 0.02).inverse)


def test_while_the_slip_is_unknown_what_is_relieved_stays_and_the_delay_with_it():
    law = two_actuators()
    state = law.start(0.0, 0.0, 0.0, 0.0)
    for slip in (0.001, 0.002):
        *_, state = law.update(state, 0.0, slip, DT)
    known = state.relieved
    assert len(known) == law.delay
    for k in range(1, 6):
        *_, state = law.update(state, 0.0, math.nan, DT)
        assert state.relieved == ((known[0],) * k + known)[: law.delay]


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("shift", [0.0, 1.0])
@pytest.mark.parametrize("by_target", [True, False])
def test_at_the_throttles_limit_its_inverses_stand_as_if_the_error_had_been_there_for_ever(
    side, shift, by_target
):
    """As of a single law: while the error asks for more than the limit even at rest."""
    limits = Range(LIMITED.low - side * shift, LIMITED.high - side * shift, LIMITED.rate)
    law = two_actuators(throttle=limits)
    limit = limits.high if side > 0 else limits.low
    for error, idle in ((0.2, True), (0.001, False)):
        state = law.start(limit - side * 0.01, 0.0, 0.0, 0.0)
        target, slip = (side * error, 0.0) if by_target else (0.0, -side * error)
        *_, state = law.update(state, target, slip, DT)
        inverse = law.throttle.inverse
        found = state.target if by_target else state.inverses[0]
        assert np.allclose(found, inverse.rest(side * error), rtol=1e-9) == idle


@pytest.mark.parametrize("exchange", [0.25, -0.25])
def test_together_two_actuators_reach_what_their_ends_give(exchange):
    spark, throttle = Range(-0.3, 0.1, 5.0), Range(-0.2, 0.4, 2.0)
    both = reach(spark, throttle, exchange)
    ends = [s + t / exchange for s in (-0.3, 0.1) for t in (-0.2, 0.4)]
    assert (both.low, both.high, both.rate) == (
        pytest.approx(min(ends)),
        pytest.approx(max(ends)),
        5.0,
    )


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("shift", [0.0, 1.0])
def test_an_inverse_at_a_limit_stands_as_if_the_error_had_been_there_for_ever(side, shift):
    """While the error asks for more than the limit even at rest; else it runs.

    shift: of the range, which may lie to one side of 0.
    """
    limits = Range(LIMITED.low - side * shift, LIMITED.high - side * shift, LIMITED.rate)
    law = internal_model(limits)
    limit = limits.high if side > 0 else limits.low
    for error, idle in ((0.2, True), (0.001, False)):
        start = law.start(limit - side * 0.01, 0.0, 0.0)
        _, state = law.update(start, side * error, 0.0, DT)
        rest = law.inverse.rest(side * error)
        assert np.allclose(state.inverse, rest, rtol=1e-9) == idle
        assert (state.command == limit) == (side * (law.inverse.D * side * error) > 0.01)

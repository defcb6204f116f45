"""Laws of what stands around a control law: ranges, schedule, governor, prefilter, both actuators."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from slipbench.controllers.compensator import Compensator
from slipbench.controllers.governor import Governor
from slipbench.controllers.internal_model import InternalModel
from slipbench.controllers.limits import Range
from slipbench.controllers.linear import Linear, in_series
from slipbench.controllers.pid import Pid
from slipbench.controllers.schedule import Schedule
from slipbench.controllers.slip_controller import SlipController, from_tree

DT = 0.001
FREE, LIMITS = Range(-1e3, 1e3, 1e9), Range(-0.1, 0.2, 6.0)
SLOW, MIDDLE, FAST = (Pid(p, 10.0 * p, 0.1 * p, FREE) for p in (1.0, 3.0, 4.0))
SCHEDULE = Schedule(((20.0, SLOW), (40.0, MIDDLE), (60.0, FAST)))
PREFILTER = (1.5, -1.3, 0.0, -0.8, 0.0)  # gain 1
BOUNDS = {"low": -0.1, "high": 0.2, "rate": 6.0}


@pytest.mark.parametrize(
    ("low", "high", "rate"),
    [
        (0.1, 0.0, 1.0),
        (0.0, 1.0, 0.0),
        (0.0, 1.0, -1.0),
        (math.nan, 1.0, 1.0),
        (0.0, 1.0, math.nan),
    ],
)
def test_a_range_in_which_nothing_lies_is_refused(low, high, rate):
    with pytest.raises(ValueError, match="no command lies in"):
        Range(low, high, rate)


def test_a_range_may_be_a_point_and_has_no_rate_unless_one_is_given():
    assert Range(0.1, 0.1, 1e-9).towards(5.0, 0.1, DT) == 0.1
    assert Range(-1.0, 1.0).towards(0.7, -0.9, 1e-9) == 0.7


@given(st.floats(-1, 1), st.floats(-1, 1))
def test_a_bound_withstands_what_would_move_a_command_out_and_nothing_else(push, last):
    moves = LIMITS.nearest(last + math.copysign(9.0, push)) if push else last
    inside = LIMITS.low <= last <= LIMITS.high
    if inside:
        assert LIMITS.withstands(push, last) == (push != 0.0 and moves == last)
    assert LIMITS.withstands(1e-9, LIMITS.high)
    assert LIMITS.withstands(-1e-9, LIMITS.low)
    assert not LIMITS.withstands(-1e-9, LIMITS.high)
    assert not LIMITS.withstands(1e-9, LIMITS.low)
    assert not LIMITS.withstands(0.0, LIMITS.high)
    assert not LIMITS.withstands(0.0, LIMITS.low)


SECTIONS = ((0.9, -0.8, 0.0, -0.85, 0.0), (0.5, 0.1, 0.05, -0.6, 0.08), (0.7, 0.2, 0.3, -0.2, 0.0))


def test_sections_in_series_are_what_scipy_makes_of_them():
    system, rng = in_series(SECTIONS), np.random.default_rng(5)  # seed 5
    rows = np.array([(b0, b1, b2, 1.0, a1, a2) for b0, b1, b2, a1, a2 in SECTIONS])
    value, x, found = rng.standard_normal(50), np.zeros(system.B.size), []
    for u in value:
        found.append(float(system.C @ x) + system.D * u)
        x = system.A @ x + system.B * u
    np.testing.assert_allclose(found, signal.sosfilt(rows, value), atol=1e-12)
    w = np.array([0.01, 0.5, 2.0])
    _, response = signal.freqz_sos(rows, worN=w)
    np.testing.assert_allclose(system.response(np.exp(1j * w)), response, rtol=1e-9)
    assert system.B.size == 5  # one of first order has one state


def test_a_system_at_rest_stays_there_and_gives_its_gain():
    system = in_series(SECTIONS)
    x = system.rest(0.3)
    np.testing.assert_allclose(system.A @ x + system.B * 0.3, x, atol=1e-12)
    assert float(system.C @ x) + system.D * 0.3 == pytest.approx(0.3 * system.gain)
    assert system.gain == pytest.approx(float(system.response(np.array([1.0 + 0j]))[0].real))


@pytest.mark.parametrize("speed", [5.0, 20.0, 25.0, 40.0, 50.0, 60.0, 90.0])
def test_gains_follow_the_speed_in_straight_lines(speed):
    expected = np.interp(speed, [20.0, 40.0, 60.0], [1.0, 3.0, 4.0])
    at = SCHEDULE.at(speed)
    assert at.proportional == pytest.approx(expected)
    assert at.integral == pytest.approx(10.0 * expected)
    assert at.derivative == pytest.approx(0.1 * expected)


def test_an_unknown_speed_has_the_gains_of_the_first_design():
    assert SCHEDULE.at(math.nan) is SLOW
    assert Schedule(((30.0, FAST),)).at(10.0) is FAST
    assert Schedule(((30.0, FAST),)).at(50.0) is FAST


@pytest.mark.parametrize("speeds", [(), (20.0, 20.0), (40.0, 20.0), (20.0, 60.0, 40.0)])
def test_a_schedule_whose_speeds_do_not_increase_is_refused(speeds):
    with pytest.raises(ValueError, match="increasing"):
        Schedule(tuple((speed, SLOW) for speed in speeds))


GOVERNOR = Governor(Range(0.0, 0.05, 0.5), 0.2, LIMITS)


def test_a_governor_without_a_gain_is_refused():
    with pytest.raises(ValueError, match="gain"):
        replace(GOVERNOR, gain=0.0)


@given(st.floats(0.0, 0.05), st.floats(-0.2, 0.2), st.floats(-0.1, 0.2))
def test_a_governor_goes_as_far_towards_the_target_as_command_rate_and_range_allow(
    last, target, command
):
    """The reference nearest to the target of those that are allowed."""
    step = 0.5 * DT
    low = max(last - step, 0.0, last + (LIMITS.low - command) * 0.2)
    high = min(last + step, 0.05, last + (LIMITS.high - command) * 0.2)
    found = GOVERNOR.update(last, target, command, DT)
    assert found == pytest.approx(min(max(target, low), high), abs=1e-12)


@pytest.mark.parametrize(("command", "side"), [(0.199, 1.0), (-0.099, -1.0)])
def test_a_reference_takes_of_a_step_what_the_command_has_left(command, side):
    """0.001 of command is left, which is 0.0002 of slip."""
    found = GOVERNOR.update(0.02, 0.02 + side * 0.01, command, DT)
    assert found == pytest.approx(0.02 + side * 0.0002)


@pytest.mark.parametrize(("command", "away"), [(0.25, 1.0), (-0.15, -1.0)])
def test_a_command_outside_its_range_may_come_back_and_go_no_further(command, away):
    last = 0.02
    assert GOVERNOR.update(last, last + away * 0.01, command, DT) == last
    back = GOVERNOR.update(last, last - away * 0.01, command, DT)
    assert back == pytest.approx(last - away * 0.5 * DT)


RNG = np.random.default_rng(11)  # seed 11
TARGETS, SLIPS = 0.02 + 0.01 * RNG.standard_normal(60), 0.015 + 0.01 * RNG.standard_normal(60)


def offsets(controller, speed=30.0, targets=TARGETS, start=(0.03, -0.02)):
    """Throttle and spark, (n, 2)."""
    state, found = controller.start(*start, float(SLIPS[0]), speed), []
    for target, slip in zip(targets, SLIPS, strict=True):
        throttle, spark, state = controller.update(state, float(target), float(slip), speed, DT)
        found.append((throttle, spark))
    return np.array(found)


def alone(law, start, targets=TARGETS):
    """Commands of a law by itself, which starts at the slip that it finds."""
    state, found = law.start(start, float(SLIPS[0]), float(SLIPS[0])), []
    for target, slip in zip(targets, SLIPS, strict=True):
        command, state = law.update(state, float(target), float(slip), DT)
        found.append(command)
    return np.array(found)


@pytest.mark.parametrize(
    ("actuator", "moved", "start"), [("throttle", 0, 0.03), ("spark", 1, -0.02)]
)
def test_a_controller_moves_its_own_actuator_as_its_law_says_and_no_other(actuator, moved, start):
    found = offsets(SlipController(actuator, MIDDLE))
    np.testing.assert_array_equal(found[:, moved], alone(MIDDLE, start))
    np.testing.assert_array_equal(found[:, 1 - moved], (0.03, -0.02)[1 - moved])


@pytest.mark.parametrize("speed", [10.0, 35.0, 50.0])
def test_a_schedule_stands_in_place_of_the_law(speed):
    found = offsets(SlipController("throttle", FAST, schedule=SCHEDULE), speed)
    np.testing.assert_array_equal(found[:, 0], alone(SCHEDULE.at(speed), 0.03))
    found = offsets(SlipController("spark", FAST, schedule=SCHEDULE), speed)
    np.testing.assert_array_equal(found[:, 1], alone(SCHEDULE.at(speed), -0.02))


def test_a_reference_goes_through_the_prefilter_before_the_law():
    found = offsets(SlipController("throttle", MIDDLE, prefilter=in_series((PREFILTER,))))
    b, a = PREFILTER[:2], (1.0, PREFILTER[3])
    passed, _ = signal.lfilter(b, a, TARGETS - SLIPS[0], zi=[0.0])
    expected = alone(MIDDLE, 0.03, SLIPS[0] + passed)
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-9)


@pytest.mark.parametrize("actuator", ["throttle", "spark"])
@pytest.mark.parametrize(("limit", "change"), [(0.2, 0.01), (-0.1, -0.01)])
@pytest.mark.parametrize("into", [True, False])
def test_what_a_limit_gives_nothing_of_goes_past_the_prefilter(actuator, limit, change, into):
    """Into the limit the prefilter's output follows the whole change at once; away from it swings."""
    law = replace(MIDDLE, limits=LIMITS)
    controller = SlipController(actuator, law, prefilter=in_series((PREFILTER,)))
    other = 0.0  # where the actuator that rests stands does not matter
    places = (limit, other) if actuator == "throttle" else (other, limit)
    state = controller.start(*places, 0.02, 30.0)
    target = 0.02 + (change if into else -change)
    *_, state = controller.update(state, target, 0.02, 30.0, DT)
    p = controller.prefilter
    rest = p.rest(target)
    assert np.allclose(state.passed, rest, atol=1e-12) == into


@pytest.mark.parametrize("actuator", ["throttle", "spark"])
def test_a_governor_looks_at_the_actuator_that_moves(actuator):
    """At its upper limit nothing more is asked for; where the other one stands does not matter."""
    law = replace(MIDDLE, limits=LIMITS)
    controller = SlipController(actuator, law, Governor(Range(0.0, 0.05, 0.5), 0.2, LIMITS))
    for at_limit in (True, False):
        here, other = (0.2, 0.0) if at_limit else (0.0, 0.2)
        places = (here, other) if actuator == "throttle" else (other, here)
        state = controller.start(*places, 0.02, 30.0)
        *_, state = controller.update(state, 0.04, 0.02, 30.0, DT)
        assert state.reference == (0.02 if at_limit else pytest.approx(0.02 + 0.5 * DT))


def test_a_controller_that_knows_no_slip_waits_and_then_starts_as_new():
    controller = SlipController("throttle", MIDDLE)
    state = controller.start(0.03, -0.02, math.nan, 30.0)
    *given, state = controller.update(state, 0.05, math.nan, 30.0, DT)
    assert given == [0.03, -0.02]
    *given, state = controller.update(state, 0.05, 0.02, 30.0, DT)
    assert given == [0.03, -0.02]
    fresh = controller.start(0.03, -0.02, 0.02, 30.0)
    assert repr(state) == repr(fresh)


def test_a_controller_that_waited_starts_with_the_gains_of_its_speed():
    designs = tuple((v, replace(law, reference_weight=0.5)) for v, law in SCHEDULE.designs)
    controller = SlipController("throttle", MIDDLE, schedule=Schedule(designs))
    state = controller.start(0.03, -0.02, math.nan, 30.0)
    *_, state = controller.update(state, 0.05, 0.02, 55.0, DT)
    assert repr(state) == repr(controller.start(0.03, -0.02, 0.02, 55.0))
    assert repr(state) != repr(controller.start(0.03, -0.02, 0.02, 30.0))


PID_TREE = {
    "kind": "pid",
    "proportional": 2.0,
    "integral": 50.0,
    "derivative": 0.03,
    "filter_time": 0.004,
    "tracking_time": 0.06,
    "reference_weight": 0.8,
}
MODEL_TREE = {
    "kind": "internal_model",
    "model": [[0.0, 0.01, 0.0, -0.95, 0.0]],
    "inverse": [[5.0, -4.75, 0.0, -0.9, 0.0]],
    "delay": 6,
}
LINEAR_TREE = {
    "kind": "linear",
    "integral": 30.0,
    "shaping": [list(PREFILTER)],
    "tracking_time": 0.05,
}


def tree(law: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"actuator": "spark", "law": law, "limits": BOUNDS, "period": 0.002, **more}


def test_the_numbers_of_a_file_are_those_of_its_law():
    assert from_tree(tree(PID_TREE)) == SlipController(
        "spark", Pid(2.0, 50.0, 0.03, LIMITS, 0.004, 0.06, 0.8)
    )
    found = from_tree(tree(LINEAR_TREE)).law
    expected = Compensator(30.0, in_series((PREFILTER,)), 0.002, LIMITS, 0.05)
    assert same(found, expected)
    found = from_tree(tree(MODEL_TREE)).law
    expected = InternalModel(
        in_series(MODEL_TREE["model"]), in_series(MODEL_TREE["inverse"]), 6, 0.002, LIMITS
    )
    assert same(found, expected)


def same(a: Any, b: Any) -> bool:
    """Equal in every number; systems by their matrices."""
    if isinstance(a, Linear) and isinstance(b, Linear):
        return all(np.array_equal(getattr(a, m), getattr(b, m)) for m in "ABCD")
    if type(a) is type(b) and isinstance(a, Compensator | InternalModel):
        return all(same(getattr(a, n), getattr(b, n)) for n in a.__dataclass_fields__)
    return bool(a == b)


def test_a_file_brings_schedule_governor_and_prefilter():
    gains = {**PID_TREE, "proportional": 3.0}
    rows = [{"speed": 20.0, "gains": PID_TREE}, {"speed": 40.0, "gains": gains}]
    slip = {"low": 0.0, "high": 0.05, "rate": 0.5}
    found = from_tree(
        tree(PID_TREE, schedule=rows, governor={"slip": slip, "gain": 0.2}, prefilter=[PREFILTER])
    )
    one, other = (Pid(p, 50.0, 0.03, LIMITS, 0.004, 0.06, 0.8) for p in (2.0, 3.0))
    assert found.schedule == Schedule(((20.0, one), (40.0, other)))
    assert found.governor == Governor(Range(0.0, 0.05, 0.5), 0.2, LIMITS)
    assert found.prefilter is not None
    assert same(found.prefilter, in_series((PREFILTER,)))


def test_a_mixed_file_brings_both_laws_and_a_governor_of_what_they_reach_together():
    throttle = {"low": -0.3, "high": 0.4, "rate": 2.0}
    slower = {**MODEL_TREE, "delay": 9}
    mixed = {
        "law": slower,
        "throttle": throttle,
        "later": [[0.05, 0.0, 0.0, -0.95, 0.0]],
        "delay": 3,
        "zone": 0.01,
        "exchange": 0.5,
    }
    slip = {"low": 0.0, "high": 0.05, "rate": 0.5}
    found = from_tree(
        tree(MODEL_TREE, mixed=mixed, governor={"slip": slip, "gain": 0.2}) | {"actuator": "mixed"}
    )
    assert found.both is not None
    assert found.both.spark is found.law
    assert same(
        found.both.throttle, replace(from_tree(tree(slower)).law, limits=Range(-0.3, 0.4, 2.0))
    )
    assert same(found.both.later, in_series(mixed["later"]))
    assert (found.both.delay, found.both.zone, found.both.exchange) == (3, 0.01, 0.5)
    assert found.governor is not None
    assert found.governor.command == Range(-0.1 - 0.3 / 0.5, 0.2 + 0.4 / 0.5, 6.0)
    at_limit = replace(found.start(0.4, 0.2, 0.02, 30.0), reference=0.02)
    *_, after = found.update(at_limit, 0.04, 0.02, 30.0, DT)
    assert after.reference == pytest.approx(0.02, abs=1e-12)
    *_, after = found.update(found.start(0.4, 0.0, 0.02, 30.0), 0.04, 0.02, 30.0, DT)
    assert after.reference > 0.02


def test_a_mixed_controller_gives_what_both_laws_give_together():
    throttle = {"low": -0.3, "high": 0.4, "rate": 2.0}
    mixed = {
        "law": MODEL_TREE,
        "throttle": throttle,
        "later": [[0.05, 0.0, 0.0, -0.95, 0.0]],
        "delay": 3,
        "zone": 0.0,
        "exchange": 0.5,
    }
    controller = from_tree(
        tree(MODEL_TREE, mixed=mixed, prefilter=[PREFILTER]) | {"actuator": "mixed"}
    )
    found = offsets(replace(controller, prefilter=None))
    state = controller.both.start(0.03, -0.02, float(SLIPS[0]), float(SLIPS[0]))
    for row, target, slip in zip(found, TARGETS, SLIPS, strict=True):
        throttle_, spark, state = controller.both.update(state, float(target), float(slip), DT)
        assert tuple(row) == (throttle_, spark)
    # At the throttle's limit a target beyond it goes past the prefilter, at the spark's it does not.
    for place, past in (((0.4, 0.0), True), ((0.3, 0.0), False), ((0.0, 0.2), False)):
        state = controller.start(*place, 0.02, 30.0)
        *_, state = controller.update(state, 0.03, 0.02, 30.0, DT)
        assert np.allclose(state.passed, controller.prefilter.rest(0.03), atol=1e-12) == past

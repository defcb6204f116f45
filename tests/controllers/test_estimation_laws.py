"""Laws of what is measured: slip with its age and source, the tracked speed, the learnt pitch."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.controllers.pitch_learner import OUTLIER, STANDING_AFTER, PitchLearner, quick
from slipbench.controllers.slip_estimator import (
    OVERDUE,
    SLOWEST,
    EstimatorState,
    SlipEstimator,
    Wheel,
)
from slipbench.controllers.speed_tracker import SpeedTracker, Track

TEETH, REAR, FRONT = 16, 0.32, 0.30
PITCH = 2 * math.pi / TEETH
ESTIMATOR = SlipEstimator(TEETH, REAR, FRONT)


def rolling(speed, seconds=0.1, slip=0.0, front=1.0, estimator=ESTIMATOR, optical=True):
    """State after a steady ride, and the time of the last rear tooth. front: its speed's share."""
    state = estimator.initial()
    rear_interval = PITCH * REAR / (speed * (1 + slip))
    front_interval = PITCH * FRONT / (speed * front)
    events = [(k * rear_interval, 0, k) for k in range(int(seconds / rear_interval) + 1)]
    events += [(k * front_interval, 1, k) for k in range(int(seconds / front_interval) + 1)]
    events += [(k * 0.004, 2, k) for k in range(int(seconds / 0.004) + 1)] if optical else []
    last = 0.0
    for time, kind, count in sorted(events):
        if kind == 0:
            state, last = estimator.rear_tooth(state, time, float(count)), time
        elif kind == 1:
            state = estimator.front_tooth(state, time, float(count))
        else:
            state = estimator.optical(state, time, speed)
    return state, last, rear_interval


def test_a_slip_is_half_an_interval_older_than_its_last_tooth():
    state, last, interval = rolling(40.0, slip=0.02)
    for wait in (0.0, 0.3 * interval, interval):
        found = ESTIMATOR.slip(state, last + wait)
        assert found.age == pytest.approx(wait + 0.5 * interval)
        assert found.value == pytest.approx(0.02, abs=1e-9)
        assert (found.speed, found.source) == (pytest.approx(40.0), "optical")


@pytest.mark.parametrize("report", [0.0, 0.006])
def test_a_tooth_that_is_half_an_interval_late_makes_the_slip_unknown(report):
    estimator = replace(ESTIMATOR, report=report)
    state, last, interval = rolling(40.0, estimator=estimator)
    state = estimator.optical(state, last + 1.4 * interval, 40.0)
    assert math.isfinite(estimator.slip(state, last + 1.49 * interval + report).value)
    assert math.isnan(estimator.slip(state, last + 1.51 * interval + report).value)


def test_an_optical_sensor_that_is_silent_gives_way_to_the_front_wheel_and_both_to_nothing():
    """Front teeth in time, no reading: the front wheel's speed, scaled; then no tooth either."""
    state, _, _ = rolling(40.0, front=0.98)
    silent = state.optical.time + ESTIMATOR.silence
    teeth = replace(state.front, time=silent), replace(state.rear, time=silent)
    state = replace(state, front=teeth[0], rear=teeth[1])
    assert ESTIMATOR.slip(state, silent - 1e-9).source == "optical"
    later = ESTIMATOR.slip(state, silent + 1e-6)
    assert later.source == "front wheel"
    assert later.speed == pytest.approx(0.98 * 40.0 * state.scale, rel=1e-6)
    at_last = ESTIMATOR.slip(state, silent + 1.6 * state.front.interval)
    assert at_last.source == "unknown"
    assert math.isnan(at_last.speed)
    assert math.isnan(at_last.value)


@pytest.mark.parametrize(("front", "expected"), [(0.98, 1 / 0.98), (0.8, 1.05), (1.2, 0.95)])
def test_the_front_wheels_scale_is_learnt_over_its_memory_and_stays_within_its_limit(
    front, expected
):
    """First order: a share of interval over memory with each tooth."""
    estimator = replace(ESTIMATOR, memory=0.5)
    state, _, _ = rolling(40.0, 0.2, front=front, estimator=estimator)
    interval = PITCH * FRONT / (40.0 * front)
    teeth = int(0.2 / interval) - 1
    share = 1 - (1 - interval / 0.5) ** teeth
    assert state.scale == pytest.approx(1 + share * (expected - 1), abs=0.06 * abs(expected - 1))


def test_a_memory_shorter_than_an_interval_learns_the_scale_at_once():
    estimator = replace(ESTIMATOR, memory=1e-4)
    state, _, _ = rolling(40.0, 0.1, front=0.98, estimator=estimator)
    assert state.scale == pytest.approx(1 / 0.98, abs=1e-6)


def test_the_scale_stays_while_the_optical_sensor_is_silent_or_the_wheel_is_slow():
    state, _, _ = rolling(40.0, front=0.98)
    time, interval = state.front.time, state.front.interval
    late = replace(state, optical=replace(state.optical, time=time + interval - 0.0151))
    after = ESTIMATOR.front_tooth(late, time + interval, state.front.learner.count + 1)
    assert after.scale == state.scale
    heard = replace(state, optical=replace(state.optical, time=time + interval - 0.015))
    after = ESTIMATOR.front_tooth(heard, time + interval, state.front.learner.count + 1)
    assert after.scale > state.scale
    slow, _, _ = rolling(SLOWEST * 0.999, 0.5, front=0.98)
    assert slow.scale == 1.0
    quick_enough, _, _ = rolling(SLOWEST * 1.05, 0.5, front=0.98)
    assert quick_enough.scale != 1.0


@pytest.mark.parametrize(("speed", "known"), [(SLOWEST, False), (SLOWEST + 1e-6, True)])
def test_below_a_walking_pace_a_slip_is_unknown(speed, known):
    state, last, _ = rolling(speed, 0.5)
    found = ESTIMATOR.slip(replace(state, optical=Track(speed, 0.0, last, 9)), last)
    assert math.isfinite(found.value) == known


def test_a_slip_at_its_lowest_is_known_and_one_below_is_not():
    for lowest, known in ((-0.021, True), (-0.019, False)):
        estimator = replace(ESTIMATOR, lowest=lowest)
        state, last, _ = rolling(40.0, slip=-0.02, estimator=estimator)
        assert math.isfinite(estimator.slip(state, last).value) == known


def test_at_their_bounds_speed_silence_lateness_and_lowest_slip_are_known():
    """Every number is exact in binary."""
    bound = 2.0**-6  # s
    estimator = replace(ESTIMATOR, silence=bound, rear_radius=1.0, lowest=-(2.0**-5))
    learner = estimator.learner.initial()
    rear = Wheel(learner, speed=3.875, time=0.0, interval=bound / 1.5)
    state = EstimatorState(rear, Wheel(learner), Track(4.0, 0.0, 0.0, 9))
    assert OVERDUE * rear.interval == bound
    found = estimator.slip(state, bound)
    assert (found.value, found.source) == (-(2.0**-5), "optical")
    assert SpeedTracker(silence=bound).update(state.optical, bound, 4.0).readings == 10


def test_the_scale_stays_at_the_slowest_speed():
    state, _, _ = rolling(40.0, front=0.98)
    front = state.front
    time, count = front.time + 20 * front.interval, front.learner.count + 1
    speed = ESTIMATOR.front_tooth(state, time, count).front.speed
    near = SLOWEST / speed
    radius = next(
        r
        for r in (near, math.nextafter(near, 0.0), math.nextafter(near, 1.0))
        if speed * r == SLOWEST
    )
    heard = replace(state, optical=replace(state.optical, time=time, speed=3.1))
    for share, stays in ((1.0, True), (1.001, False)):
        estimator = replace(ESTIMATOR, front_radius=share * radius)
        after = estimator.front_tooth(heard, time, count)
        assert (after.scale == state.scale) == stays


def test_a_reading_that_is_not_a_number_changes_nothing():
    state, last, _ = rolling(40.0)
    assert ESTIMATOR.optical(state, last, math.nan) is state


@pytest.mark.parametrize("wheel", ["rear", "front"])
def test_a_tooth_moves_its_own_wheel_and_learning_can_be_held(wheel):
    state, _, _ = rolling(40.0, 0.5)
    take = getattr(ESTIMATOR, f"{wheel}_tooth")
    before = getattr(state, wheel)
    time, count = before.time + 1.03 * before.interval, before.learner.count + 1
    free, held = take(state, time, count), take(state, time, count, learning=False)
    default = take(state, time, count, True)
    assert repr(free) == repr(default)
    assert getattr(held, wheel).learner.level == before.learner.level
    assert getattr(free, wheel).learner.level != before.learner.level
    other = "front" if wheel == "rear" else "rear"
    for after in (free, held):
        assert getattr(after, other) is getattr(state, other)
        assert after.optical is state.optical
        assert getattr(after, wheel).time == time
        assert getattr(after, wheel).interval == pytest.approx(1.03 * before.interval)
    if wheel == "rear":
        assert free.scale == state.scale


def test_after_a_lost_tooth_an_interval_is_unknown():
    state, _, _ = rolling(40.0)
    rear = state.rear
    after = ESTIMATOR.rear_tooth(state, rear.time + 2 * rear.interval, rear.learner.count + 2)
    assert math.isnan(after.rear.speed)
    assert math.isnan(after.rear.interval)
    again = ESTIMATOR.rear_tooth(after, after.rear.time + rear.interval, rear.learner.count + 3)
    assert again.rear.speed == pytest.approx(rear.speed)


@given(st.integers(2, 40))
def test_a_tracked_speed_is_the_line_through_its_first_readings(n):
    """Brookner: until the memory has passed, the straight line by least squares."""
    rng = np.random.default_rng(n)
    t = np.arange(n) * 0.001
    z = 30.0 - 4.0 * t + 0.05 * rng.standard_normal(n)
    tracker, track = SpeedTracker(memory=10.0), Track()
    for time, reading in zip(t, z, strict=True):
        track = tracker.update(track, float(time), float(reading))
    slope, level = np.polyfit(t - t[-1], z, 1)
    assert track.speed == pytest.approx(level, abs=1e-6)
    assert track.slope == pytest.approx(slope, rel=1e-4, abs=1e-4)
    assert (track.readings, track.time) == (n, t[-1])


def test_a_tracked_speed_is_critically_damped():
    """With a short memory: the poles of the error are both exp(-dt / tau)."""
    dt, tau = 0.004, 0.016
    tracker, track = SpeedTracker(memory=tau), Track(10.0, 0.0, 0.0, 1_000_000)
    speeds = []
    for k in range(1, 60):
        track = tracker.update(track, k * dt, 11.0)
        speeds.append(11.0 - track.speed)
    theta = math.exp(-dt / tau)
    n = np.arange(1, 60)
    # e_k = theta^k (A + B k) with e_0 = 1 and no slope: B = theta - 1 over theta ... by two samples
    b = speeds[0] / theta - 1.0
    np.testing.assert_allclose(speeds, theta**n * (1.0 + b * n), atol=1e-9)
    assert speeds[0] == pytest.approx(theta**2)


@pytest.mark.parametrize(
    ("gap", "anew"), [(0.0149, False), (0.0151, True), (0.0, True), (-0.004, True)]
)
def test_a_reading_after_a_silence_or_from_the_past_begins_anew(gap, anew):
    track = Track(20.0, 1.0, 5.0, 8)
    after = SpeedTracker().update(track, 5.0 + gap, 30.0)
    assert (after == Track(30.0, 0.0, 5.0 + gap, 1)) == anew


@pytest.mark.parametrize("teeth", [5, 16, 24])
def test_the_kernel_keeps_what_turns_with_the_wheel_and_stops_what_is_slow(teeth):
    kernel = quick(teeth)
    assert kernel.size == 2 * (teeth + (teeth % 2 == 0)) - 1
    at = np.arange(kernel.size) - kernel.size // 2
    for order in range(teeth):
        gain = float(np.sum(kernel * np.cos(2 * np.pi * order * at / teeth)))
        assert gain == pytest.approx(0.0 if order == 0 else 1.0, abs=1e-12)
    ramp = float(np.sum(kernel * at))
    assert ramp == pytest.approx(0.0, abs=1e-12)
    assert float(np.sum(kernel * at**2)) == pytest.approx(0.0, abs=1e-9)  # (1 - M)^2: no parabola
    assert not kernel.flags.writeable


def turned(learner, turns, gaps, speed=100.0, learning=True, state=None):
    """State after so many turns at a steady speed, rad/s, and the speeds that it gave."""
    state = learner.initial() if state is None else state
    base = 0.0 if math.isnan(state.time) else state.time
    first = 0 if math.isnan(state.count) else int(state.count) + 1
    time, found = base, []
    for count in range(first, first + turns * learner.teeth + 1):
        if count:
            time += PITCH16[(count - 1) % learner.teeth] * gaps[(count - 1) % learner.teeth] / speed
        speed_now, state = learner.update(state, time, float(count), learning)
        found.append(speed_now)
    return state, np.array(found)


PITCH16 = np.full(16, PITCH)
GAPS = 1 + 0.02 * np.cos(2 * np.pi * 3 * np.arange(16) / 16)
LEARNER = PitchLearner(16)


def test_gaps_are_learnt_and_then_taken_out_of_the_speed():
    state, speeds = turned(LEARNER, 200, GAPS)
    np.testing.assert_allclose(state.gaps, GAPS - 1, atol=2e-4)
    assert np.max(np.abs(speeds[1:33] / 100.0 - 1)) > 0.015
    assert np.max(np.abs(speeds[-16:] / 100.0 - 1)) < 3e-4
    assert np.all(state.deviation < LEARNER.ready)
    for count in (0, 5, 16, 37):
        assert LEARNER.angle(state, count) == pytest.approx(PITCH * GAPS[count % 16], rel=3e-4)


def test_gaps_of_an_odd_number_of_teeth_are_learnt_where_they_are():
    gaps = 1 + 0.02 * np.cos(2 * np.pi * 2 * np.arange(5) / 5 + 0.4)
    state, _ = turned(PitchLearner(5), 400, gaps)
    np.testing.assert_allclose(state.gaps, gaps - 1, atol=5e-4)


def test_gaps_that_are_not_known_well_are_taken_as_even():
    state, _ = turned(LEARNER, 3, GAPS)
    assert LEARNER.angle(state, 4) == PITCH
    assert np.max(state.deviation) > LEARNER.ready
    eager = replace(LEARNER, ready=1.01 * float(np.max(state.deviation)))
    assert eager.angle(state, 4) != PITCH
    shy = replace(LEARNER, ready=0.99 * float(np.max(state.deviation)))
    assert shy.angle(state, 4) == PITCH


def test_gaps_that_have_not_been_learnt_yet_are_even_beside_those_that_have():
    state, _ = turned(LEARNER, 2, GAPS)
    for k in range(4):
        _, state = LEARNER.update(state, state.time + 0.004, state.count + 1)
        assert sum(weight > 0 for weight in state.weight) == k + 1 or k == 0
        np.testing.assert_allclose(state.gaps, 0.0, atol=0.05)
    assert np.ptp(state.share) > 0


def test_at_its_bound_a_gap_is_not_known_well_and_a_wheel_stands():
    state, _ = turned(LEARNER, 60, GAPS)
    for weight, even in ((4.0, True), (4.001, False)):  # exact in binary: 4 * 0.5^2
        known = replace(state, weight=(weight,) * 16)
        assert (replace(LEARNER, ready=0.5).angle(known, 4) == PITCH) == even
    _, state = LEARNER.update(LEARNER.initial(), 0.0, 0.0)
    speed, _ = LEARNER.update(state, STANDING_AFTER, 1.0)
    assert math.isnan(speed)


def test_nothing_is_learnt_while_learning_is_held():
    state, speeds = turned(LEARNER, 20, GAPS, learning=False)
    assert state.weight == LEARNER.initial().weight
    assert state.level == LEARNER.initial().level
    np.testing.assert_allclose(speeds[1:], 100.0 / GAPS[np.arange(320) % 16], rtol=1e-9)


@pytest.mark.parametrize(
    ("later", "counts", "known"),
    [
        (0.004, 1, True),
        (0.004, 2, False),
        (0.004, 0, False),
        (STANDING_AFTER - 1e-6, 1, True),
        (STANDING_AFTER + 1e-6, 1, False),
        (0.0, 1, False),
        (-0.001, 1, False),
    ],
)
def test_a_speed_needs_the_next_tooth_in_time(later, counts, known):
    state, _ = turned(LEARNER, 4, GAPS)
    speed, after = LEARNER.update(state, state.time + later, state.count + counts)
    assert math.isfinite(speed) == known
    assert (after.time, after.count) == (state.time + later, state.count + counts)
    if known:
        assert speed == pytest.approx(PITCH / later)
    else:
        assert after.filled == 0
        assert after.weight == state.weight


def test_after_a_lost_tooth_nothing_is_learnt_until_two_turns_have_passed():
    state, _ = turned(LEARNER, 10, GAPS)
    _, state = LEARNER.update(state, state.time + 0.008, state.count + 2)
    before = state.weight
    for k in range(2 * 16 + 1):
        assert state.weight == before, k
        _, state = LEARNER.update(state, state.time + 0.004, state.count + 1)
    assert state.weight != before
    assert sum(a != b for a, b in zip(state.weight, before, strict=True)) == 1


def test_the_tooth_that_is_learnt_is_the_one_of_a_turn_ago():
    """It is the middle of two turns and one tooth: the same gap as the present one."""
    state, _ = turned(LEARNER, 10, GAPS)
    for k in range(20):
        gap = int(state.count) % 16
        before = state.level
        _, state = LEARNER.update(state, state.time + 0.004 * (1 + 0.001 * k), state.count + 1)
        changed = [j for j in range(16) if state.level[j] != before[j]]
        assert changed == [gap]
        assert state.share[gap] == math.exp(-state.level[gap])


def test_a_single_wild_interval_moves_a_gap_by_three_deviations_at_most():
    state, _ = turned(LEARNER, 60, GAPS)
    logs = list(state.logs)
    logs[len(logs) // 2 + 1] += 5.0  # the interval that is judged next is wrong by a factor of 150
    wild = replace(state, logs=tuple(logs))
    gap = int(state.count) % 16
    _, after = LEARNER.update(wild, state.time + 0.004, state.count + 1)
    limit = OUTLIER * math.sqrt(state.variance + 1 / state.weight[gap])
    variance = state.variance + (limit**2 - state.variance) / 64
    gain = 1 / (variance + 1e-12 / 6 / 0.004**2)
    weight = state.weight[gap] * 0.5 ** (1 / LEARNER.memory) + gain
    assert after.variance == pytest.approx(variance)
    assert after.weight[gap] == pytest.approx(weight)
    assert after.level[gap] - state.level[gap] == pytest.approx(limit * gain / weight)
    low = replace(
        state, logs=tuple(x - 10.0 * (i == len(logs) // 2 + 1) for i, x in enumerate(logs))
    )
    _, after = LEARNER.update(low, state.time + 0.004, state.count + 1)
    assert after.level[gap] - state.level[gap] == pytest.approx(-limit * gain / weight)


@pytest.mark.parametrize("weight", [0.0, 0.5])
def test_a_first_surprise_is_taken_whole_and_says_nothing_of_the_restlessness(weight):
    """Of a gap of which something is known, however little, it is cut and counted."""
    state, _ = turned(LEARNER, 60, GAPS)
    logs = list(state.logs)
    logs[len(logs) // 2 + 1] += 50.0
    wild = replace(state, logs=tuple(logs), weight=(weight,) * 16)
    gap = int(state.count) % 16
    _, after = LEARNER.update(wild, state.time + 0.004, state.count + 1)
    moved = after.level[gap] - state.level[gap]
    if weight == 0.0:
        assert after.variance == state.variance
        assert moved > 40.0
    else:
        limit = OUTLIER * math.sqrt(state.variance + 1 / weight)
        assert after.variance == pytest.approx(state.variance + (limit**2 - state.variance) / 64)
        gain = 1 / (after.variance + 1e-12 / 6 / 0.004**2)
        kept = weight * 0.5 ** (1 / LEARNER.memory)
        assert moved == pytest.approx(limit * gain / (kept + gain))


def test_a_tooth_is_half_forgotten_after_the_memory():
    """Without anything new, so many turns at memory = 1 leave 2^-n of the weight."""
    learner = PitchLearner(16, memory=1.0)
    state, _ = turned(learner, 60, GAPS)
    rate = 1 / (state.variance + 1e-12 / 6 / (PITCH / 100.0) ** 2)
    assert np.mean(state.weight) == pytest.approx(2 * rate, rel=0.2)  # w = w / 2 + rate

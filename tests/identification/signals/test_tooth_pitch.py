"""Gaps between teeth are found as they are, with honest errors; the wheel's motion stays."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from slipbench.controllers.pitch_learner import PitchLearner
from slipbench.identification.response.identify import identify
from slipbench.identification.signals.teeth import speed_from_teeth
from slipbench.identification.signals.tooth_evidence import Answers
from slipbench.identification.signals.tooth_pitch import NoToothPitch, ToothPitch, learn_pitch
from tests.identification.signals.toothed_wheel import coloured, random_gaps, tooth_times
from tests.identification.synthetic_recording import Truth, recording

RATE = 4000.0


def restless(rng, lasts=20.0, turning=26.0, size=2e-3, corner=20.0):
    t = np.arange(0, lasts, 1 / RATE)
    return t, 2 * np.pi * turning * (1 + coloured(rng, t.size, RATE, size, corner))


def answering(t, start, stop, frequency, share=0.01):
    """A sine (or a sweep, from a pair) at an input, and the wheel's answer: 8 Hz behind 10 ms."""
    first, last = frequency if isinstance(frequency, tuple) else (frequency, frequency)
    tau, lasts = np.clip(t - start, 0, stop - start), stop - start
    on = (t >= start) & (t < stop)
    u = np.where(on, np.sin(2 * np.pi * (first * tau + (last - first) * tau**2 / 2 / lasts)), 0)
    w = 2 * np.pi * 8
    b, a, _ = signal.cont2discrete(([w * w], [1, 0.5 * w, w * w]), 1 / RATE, method="foh")
    return u, share * signal.lfilter(b[0], a, np.interp(t - 0.01, t, u, left=0))


def error(found, gaps):
    assert isinstance(found, ToothPitch), found
    return float(np.sqrt(np.mean((found.gaps - gaps) ** 2)))


@given(
    seed=st.integers(0, 999),
    teeth=st.integers(2, 60),
    turning=st.floats(5, 30),
    size=st.floats(0, 0.05),
)
@settings(max_examples=20, deadline=None)
def test_the_gaps_are_found_whatever_the_disc(seed, teeth, turning, size):
    rng = np.random.default_rng(seed)
    gaps = random_gaps(rng, teeth, size)
    t, speed = restless(rng, turning=turning)
    found = learn_pitch(*tooth_times(t, speed, gaps), teeth)
    assert error(found, gaps) < 5e-4
    assert abs(found.gaps.sum()) < 1e-9


@pytest.mark.parametrize("corner", [1.0, 20.0, 200.0])
def test_the_errors_are_honest(corner):
    inside = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        gaps = random_gaps(rng, 16)
        found = learn_pitch(*tooth_times(*restless(rng, corner=corner), gaps), 16)
        inside.append(np.abs(found.gaps - gaps) < found.quantile * found.deviation)
    assert 0.88 < np.mean(inside) < 0.99


@given(start=st.integers(-1000, 100_000))
@settings(max_examples=10, deadline=None)
def test_which_tooth_is_called_the_first_changes_nothing_else(start):
    rng = np.random.default_rng(7)
    time, count = tooth_times(*restless(rng, 5.0), random_gaps(rng, 16))
    one, other = learn_pitch(time, count, 16), learn_pitch(time, count + start, 16)
    np.testing.assert_allclose(np.roll(one.gaps, start), other.gaps, atol=1e-12)


def test_lost_teeth_and_standing_are_left_out():
    rng = np.random.default_rng(3)
    gaps = random_gaps(rng, 16)
    time, count = tooth_times(*restless(rng), gaps)
    time[count > 4000] += 3.0  # it stood for 3 s
    keep = np.ones(time.size, bool)
    for start in rng.integers(100, time.size - 100, 20):
        keep[start : start + rng.integers(1, 9)] = False
    assert error(learn_pitch(time[keep], count[keep], 16), gaps) < 2e-4


def test_single_shocks_count_little():
    rng = np.random.default_rng(4)
    gaps = random_gaps(rng, 16)
    t, speed = restless(rng)
    for at in rng.uniform(1, 19, 15):
        speed = speed * (1 + 0.2 * np.exp(-(((t - at) / 0.004) ** 2)))
    assert error(learn_pitch(*tooth_times(t, speed, gaps), 16), gaps) < 3e-4


def test_a_disc_with_a_tooth_left_out_is_a_disc_with_one_long_gap():
    gaps = np.full(35, 35 / 36 - 1)
    gaps[-1] = 2 * 35 / 36 - 1
    time, count = tooth_times(*restless(np.random.default_rng(5)), gaps)
    found = learn_pitch(time, count, 35)
    assert error(found, gaps) < 5e-4
    shown = speed_from_teeth(time, count, 35, gaps=found.gaps).value
    assert np.std(shown) / np.mean(shown) < 3e-3


def test_what_is_learnt_is_taken_off_every_order():
    rng = np.random.default_rng(6)
    gaps = random_gaps(rng, 16)
    time, count = tooth_times(*restless(rng, 30.0, size=5e-4), gaps)
    half = time.size // 2
    found = learn_pitch(time[:half], count[:half], 16)
    for order in range(1, 9):
        wave = np.exp(-2j * np.pi * order * count[half:-1] / 16)
        raw = speed_from_teeth(time[half:], count[half:], 16).value
        clean = speed_from_teeth(time[half:], count[half:], 16, gaps=found.gaps).value
        before, after = (abs(np.mean((x - x.mean()) * wave)) for x in (raw, clean))
        assert 20 * np.log10(before / after) > 25


@pytest.mark.parametrize(
    ("start", "stop", "frequency"),
    [(1.0, 19.0, 7.1), (1.0, 19.0, (0.5, 15.0)), (3.0, 17.0, 7.5), (6.0, 17.0, 15.0)],
    ids=["apart", "sweeping through", "once a turn", "twice a turn"],
)
def test_the_answer_to_an_excitation_is_not_taken_for_teeth(start, stop, frequency):
    rng = np.random.default_rng(8)
    gaps = random_gaps(rng, 16)
    t, speed = restless(rng, turning=7.5, size=1e-3)
    u, answer = answering(t, start, stop, frequency)
    time, count = tooth_times(t, speed * (1 + answer), gaps)
    found = learn_pitch(time, count, 16, (Answers(t[::4], u[::4]),))
    shift = [ToothPitch.line(found, m) - _line(gaps, m) for m in (1, 2)]
    assert np.max(np.abs(shift)) < 0.02 * np.ptp(answer) / 2
    assert error(found, gaps) < 1e-3


def _line(gaps, order):
    return 2 * abs(np.mean(gaps * np.exp(-2j * np.pi * order * np.arange(gaps.size) / gaps.size)))


def test_an_excitation_that_turns_with_the_wheel_throughout_is_refused():
    rng = np.random.default_rng(9)
    t, speed = restless(rng, turning=7.5, size=1e-4)
    u, answer = answering(t, -1.0, 30.0, 7.5)
    times = tooth_times(t, speed * (1 + answer), random_gaps(rng, 16))
    found = learn_pitch(*times, 16, (Answers(t[::4], u[::4]),))
    assert isinstance(found, NoToothPitch)
    assert "turns with the wheel" in found.reason


def test_an_input_that_moved_only_while_teeth_were_lost_does_no_harm():
    rng = np.random.default_rng(10)
    gaps = random_gaps(rng, 16)
    t, speed = restless(rng)
    time, count = tooth_times(t, speed, gaps)
    seen = (time < 10) | (time > 15)
    moved = Answers(t, np.where((t > 11) & (t < 14), 1.0, 0.0))
    assert error(learn_pitch(time[seen], count[seen], 16, (moved, moved)), gaps) < 2e-4


def test_too_little_is_refused():
    time, count = tooth_times(*restless(np.random.default_rng(1), 0.5), np.zeros(16))
    assert "turns without a lost tooth" in learn_pitch(time, count, 16).reason
    assert "nothing to compare" in learn_pitch(time, count, 1).reason
    assert isinstance(learn_pitch(np.empty(0), np.empty(0), 16), NoToothPitch)


def ridden(learner, time, count, learning=True):
    state, speed = learner.initial(), []
    for t, k in zip(time.tolist(), count.tolist(), strict=True):
        shown, state = learner.update(state, t, k, learning)
        speed.append(shown)
    return np.array(speed), state


@pytest.mark.parametrize("teeth", [16, 35])
def test_learning_while_riding_comes_to_the_same(teeth):
    rng = np.random.default_rng(11)
    gaps = random_gaps(rng, teeth)
    time, count = tooth_times(*restless(rng, 12.0), gaps)
    speed, state = ridden(PitchLearner(teeth), time, count)
    assert np.sqrt(np.mean((state.gaps - gaps) ** 2)) < 3e-4
    late = slice(speed.size // 2, None)
    learnt = speed_from_teeth(time, count, teeth, gaps=gaps).value
    np.testing.assert_allclose(speed[1:][late], learnt[late], rtol=2e-3)
    assert len(state.logs) == 2 * teeth + 1


def test_a_learner_bridges_nothing_and_learns_only_when_told():
    rng = np.random.default_rng(12)
    time, count = tooth_times(*restless(rng, 4.0), random_gaps(rng, 16))
    keep = np.ones(time.size, bool)
    keep[500:507] = False
    speed, state = ridden(PitchLearner(16), time[keep], count[keep])
    assert np.flatnonzero(np.isnan(speed)).tolist() == [0, 500]
    _, untaught = ridden(PitchLearner(16), time, count, learning=False)
    assert not untaught.gaps.any()
    assert state.gaps.any()


def test_a_slow_wheel_keeps_the_answer_that_notches_would_hollow_out():
    truth = Truth(speed=16.0, tooth_error=0.004, noise=0.005)
    found = identify(recording(truth))
    assert isinstance(found.motion.pitch, ToothPitch)
    assert found.motion.orders == ()
    lines = found.main.frequency < 14
    ratio = found.main.value[lines] / truth.response(found.main.frequency[lines])
    assert np.percentile(np.abs(ratio - 1), 95) < 0.05

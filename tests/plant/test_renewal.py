"""Which frames were renewed, and whether in a rhythm: on frames whose truth is known."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from slipbench.plant.update_times import renewals, rhythm

FRAMES = 1200


def again_of(fresh: np.ndarray, value: np.ndarray) -> np.ndarray:
    """1 where a frame tells exactly what the one before it told."""
    told = value[np.maximum.accumulate(np.where(fresh, np.arange(fresh.size), 0))]
    return np.concatenate(([0.0], (np.diff(told) == 0.0).astype(float)))


def held(hold: float, phase: float) -> np.ndarray:
    """Frames that are the first of a hold."""
    return np.diff(np.floor((np.arange(FRAMES) + phase) / hold), prepend=-1.0) != 0.0


seeds = st.integers(0, 2**31)


@settings(deadline=None)
@given(st.floats(1.3, 40.0), st.floats(0.0, 1.0), seeds)
def test_a_hold_is_told_within_one_and_a_half_hundredths(hold, phase, seed):
    noisy = np.random.default_rng(seed).standard_normal(FRAMES)
    found = rhythm(again_of(held(hold, phase * hold), noisy))
    assert found == pytest.approx(hold, rel=0.015)


@settings(deadline=None)
@example(1.9765625, 0)
@example(2.0234375, 0)
@given(st.floats(1.3, 8.0), seeds)
def test_also_where_the_value_rests_most_of_the_time(hold, seed):
    """A throttle that moves in bursts: nothing new is told in between, renewed or not."""
    rng = np.random.default_rng(seed)
    moves = np.repeat(rng.uniform(size=FRAMES // 60) < 0.5, 60)
    moves[:300] = True
    value = np.cumsum(np.where(moves, rng.standard_normal(FRAMES), 0.0))
    found = rhythm(again_of(held(hold, 0.3), value))
    assert found == pytest.approx(hold, rel=0.02)


@settings(deadline=None)
@given(st.floats(3.0, 20.0), st.floats(0.0, 0.4), st.booleans(), seeds)
def test_a_hold_with_jitter_is_periodic(hold, jitter, rests, seed):
    """Every hold is longer or shorter by up to a share of it; the phase wanders without limit."""
    rng = np.random.default_rng(seed)
    begins = np.cumsum(hold * (1.0 + jitter * rng.uniform(-1.0, 1.0, 2 * FRAMES)))
    fresh = np.diff(np.searchsorted(begins, np.arange(FRAMES)), prepend=-1) > 0
    moves = np.repeat(rng.uniform(size=FRAMES // 60) < 0.5, 60) if rests else np.ones(FRAMES, bool)
    moves[:300] = True
    value = np.cumsum(np.where(moves, rng.standard_normal(FRAMES), 0.0))
    assert rhythm(again_of(fresh, value)) == pytest.approx(hold, rel=0.1)


@settings(deadline=None)
@given(st.floats(0.0, 0.9), seeds)
def test_by_chance_there_is_none(share, seed):
    rng = np.random.default_rng(seed)
    fresh = rng.uniform(size=FRAMES) >= share
    assert rhythm(again_of(fresh, rng.standard_normal(FRAMES))) == 0.0


@settings(deadline=None)
@given(st.floats(0.0, 0.9), seeds)
def test_nor_where_the_value_rests_most_of_the_time(share, seed):
    rng = np.random.default_rng(seed)
    fresh = rng.uniform(size=FRAMES) >= share
    moves = np.repeat(rng.uniform(size=FRAMES // 60) < 0.5, 60)
    value = np.cumsum(np.where(moves, rng.standard_normal(FRAMES), 0.0))
    assert rhythm(again_of(fresh, value)) == 0.0


@settings(deadline=None)
@given(st.floats(0.002, 0.2), seeds)
def test_a_coarse_quantum_is_no_rhythm(rate, seed):
    """Values that move little repeat, longest where they turn."""
    rng = np.random.default_rng(seed)
    course = np.cumsum(rate * rng.standard_normal(FRAMES))
    assert rhythm(again_of(np.ones(FRAMES, bool), np.round(course))) == 0.0


def test_late_is_what_repeated_frames_tell_less_what_there_is():
    value = np.arange(float(FRAMES))
    known = renewals(value, again_of(held(4.0, 0.0), value), 0.5)
    assert known is not None
    assert known.share == pytest.approx(0.75, abs=0.01)
    assert np.array_equal(known.late, -(np.arange(FRAMES) % 4).astype(float))


@settings(deadline=None)
@given(st.floats(3.0, 40.0), st.floats(2.0, 20.0))
def test_what_moves_slowly_from_frame_to_frame_is_held_all_the_same(hold, steps):
    """steps: what it moves in a hold; between two frames it is less than one, or more."""
    value = steps / hold * np.arange(float(FRAMES))
    known = renewals(value, again_of(held(hold, 0.0), value), 1.0)
    assert known is not None
    assert known.late.min() == pytest.approx(-steps, abs=1.01 * max(1.0, steps / hold))


def test_frames_that_are_all_renewed_tell_nothing():
    value = np.arange(200.0)
    assert renewals(value, again_of(np.ones(200, bool), value), 0.5) is None

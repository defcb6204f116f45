"""Effects over the road: placebo locations and other trials give the scatter of magnitude."""

import numpy as np
import pytest

from slipbench.identification.mismatch.naming.placebo import (
    PLACES,
    PlaceboLocation,
    at_places,
    between_places,
    between_trials,
    placebo_inflation,
)

TRIALS = 4
ENERGY = 50.0


def placebos(amplitudes, own=1.0):
    """Consecutive placebo locations; amplitudes: (places, trials)."""
    energy = np.full(TRIALS, ENERGY)
    return [PlaceboLocation(3.0 * i, energy, np.asarray(a), own) for i, a in enumerate(amplitudes)]


def scattered(inflation, places, seed):
    """Amplitudes without an effect; inflation: variance of noise over that of white noise."""
    rng = np.random.default_rng(seed)
    return np.sqrt(inflation / ENERGY) * rng.standard_normal((places, TRIALS))


@pytest.mark.parametrize("size", [-2.0, 0.5, 3.0])
def test_what_every_trial_shows_alike_does_not_blur_itself(size):
    there = between_trials(placebos(np.full((6, TRIALS), size)))
    assert there is not None
    assert there.inflation == 1.0


@pytest.mark.parametrize("inflation", [1.0, 5.0, 40.0])
def test_noise_is_found_from_trial_to_trial_whether_or_not_something_is_there(inflation):
    nothing = scattered(inflation, 400, seed=3)
    for size in (0.0, 2.0):
        found = between_trials(placebos(nothing + size))
        assert found is not None
        assert found.inflation == pytest.approx(inflation, rel=0.15)
        assert found.freedom == 400 * (TRIALS - 1)


def test_other_places_tell_what_trials_have_in_common():
    """An error of the simulation itself is similar in all trials, and at all places."""
    rng = np.random.default_rng(4)
    common = rng.standard_normal((200, 1)) * np.ones(TRIALS)
    places = placebos(common)
    assert between_trials(places).inflation == 1.0
    inflation_there = between_places(places, at=0.0)
    assert inflation_there.inflation == pytest.approx(TRIALS * ENERGY, rel=0.25)
    assert placebo_inflation(places, at=0.0) == inflation_there


def test_the_place_itself_does_not_count_among_the_others():
    amplitudes = scattered(1.0, PLACES + 1, seed=5)
    amplitudes[0] = 100.0
    assert between_places(placebos(amplitudes), at=0.0).inflation < 5.0
    assert between_places(placebos(amplitudes), at=3.0).inflation > 1e4


def test_few_places_and_a_single_trial_tell_nothing():
    assert between_places(placebos(scattered(1.0, PLACES, seed=6)), at=0.0) is None
    alone = [PlaceboLocation(0.0, np.array([ENERGY, 0.0]), np.array([1.0, 0.0]), 1.0)]
    assert between_trials(alone) is None
    assert placebo_inflation(alone, at=0.0) is None


def test_signatures_that_are_alike_count_as_one():
    same = at_places(range(5), *np.ones((2, TRIALS, 5)) * ENERGY, alike=np.ones((5, 5)))
    apart = at_places(range(5), *np.ones((2, TRIALS, 5)) * ENERGY, alike=np.eye(5))
    assert between_trials(same).freedom == pytest.approx(TRIALS - 1)
    assert between_trials(apart).freedom == pytest.approx(5 * (TRIALS - 1))

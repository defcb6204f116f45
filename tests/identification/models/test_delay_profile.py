"""The delay's profile: it holds the truth, widens with doubt, and narrows with knowledge."""

import numpy as np
import pytest

from slipbench.identification.models.delay_profile import (
    DelayProfile,
    NoDelay,
    delay_profile,
    felt_right_zeros,
)
from slipbench.identification.models.model_order import all_pole, choose_order
from slipbench.identification.models.stable_rational import Order
from slipbench.identification.response.independent_lines import KnownPath, without
from tests.identification.response.known_lines import chain, lines

TRIED = (Order(2, 0), Order(3, 0), Order(4, 0))
NOTHING = KnownPath()


def profile(seed=1, model=None, noise=0.01, tried=TRIED, path=NOTHING):
    known = without(lines(model or chain(), noise, seed), path)
    return delay_profile(choose_order(known, tried), points=16)


@pytest.fixture(scope="module")
def profiles():
    return [profile(seed) for seed in range(10)]


def test_the_interval_holds_the_truth(profiles):
    assert np.mean([p.low <= 0.010 <= p.high for p in profiles]) >= 0.9


def test_the_estimate_lies_in_the_interval_and_near_the_truth(profiles):
    assert all(p.low <= p.delay <= p.high for p in profiles)
    assert abs(np.median([p.delay for p in profiles]) - 0.010) < 0.001


def test_doubt_about_the_order_widens_the_interval(profiles):
    sure = [profile(seed, tried=(Order(3, 0),)) for seed in range(5)]
    assert all(
        a.high - a.low <= b.high - b.low + 1e-4 for a, b in zip(sure, profiles, strict=False)
    )


def test_less_noise_narrows_it(profiles):
    assert np.ptp([profile(noise=0.001).low, profile(noise=0.001).high]) < 0.002


@pytest.mark.parametrize("delay", [0.0, 0.004, 0.020])
def test_any_delay_is_found(delay):
    found = profile(model=chain(delay), noise=0.002)
    assert found.low - 5e-4 <= delay <= found.high + 5e-4


def test_a_known_delay_of_the_path_is_no_longer_in_it():
    found = profile(noise=0.002, path=KnownPath(delay=0.004))
    assert found.delay == pytest.approx(profile(noise=0.002).delay - 0.004, abs=2e-4)


def test_a_lag_that_is_not_known_passes_for_delay_and_a_known_one_does_not():
    def behind_a_lag(noise):
        data = lines(chain(), noise)
        return without(data, KnownPath(leads=(0.003,)))  # dividing by a lead adds a lag

    tried = (Order(3, 0),)
    seen = delay_profile(choose_order(behind_a_lag(0.002), tried), points=16)
    known = without(behind_a_lag(0.002), KnownPath(lags=(0.003,)))
    told = delay_profile(choose_order(known, tried), points=16)
    assert seen.delay > 0.0108
    assert told.delay == pytest.approx(0.010, abs=3e-4)


def test_a_zero_on_the_right_stands_for_a_delay_and_is_not_believed():
    found = profile(noise=0.002, tried=(Order(3, 1),))
    early = found.grid < 0.005
    assert isinstance(found, DelayProfile)
    assert not found.profiles[0].minimum_phase[early].any()
    assert found.low > 0.005


def test_where_nothing_is_minimum_phase_there_is_no_delay():
    found = profile(model=chain(0.0, zeros=(60.0,)), noise=0.001, tried=(Order(3, 1),))
    assert isinstance(found, NoDelay) or found.delay > 0.01  # the zero passes for a longer delay


def test_a_zero_far_beyond_the_band_is_not_felt():
    near, far = chain(zeros=(60.0,)), chain(zeros=(1e6,))
    assert felt_right_zeros(near, 12.0).size == 1
    assert felt_right_zeros(far, 12.0).size == 0


def test_the_delay_is_within_a_millisecond_though_the_order_is_not_given():
    """Seeds that had no part in the choice of the criterion."""
    found = [profile(seed, tried=all_pole(), noise=0.01).delay for seed in range(500, 512)]
    assert np.mean(np.abs(np.array(found) - 0.010) < 0.001) >= 0.85


@pytest.mark.parametrize("doubt", [0.0005, 0.002])
def test_doubt_about_a_known_lag_is_doubt_about_the_delay(doubt):
    choice = choose_order(lines(chain(), 0.002, 1), TRIED)
    sure, unsure = (delay_profile(choice, points=16, doubt=d) for d in (0.0, doubt))
    assert unsure.delay == sure.delay
    for own, wide in (
        (sure.delay - sure.low, unsure.delay - unsure.low),
        (sure.high - sure.delay, unsure.high - unsure.delay),
    ):
        assert wide == pytest.approx(np.hypot(own, 1.96 * doubt), abs=1e-6)

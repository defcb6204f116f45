"""The check in time: the truth fits, a wrong model does not, and what is not there is said."""

import numpy as np
import pytest

from slipbench.identification.models.time_check import NoStretch, Stretch, fit_percent, time_check
from tests.identification.response.known_lines import chain
from tests.identification.synthetic_recording import sweep

RATE = 500.0
T = np.arange(0, 24, 1 / RATE)
U = sweep(T - 2, 20.0, 0.5, 12.0)
F = np.where((T >= 2) & (T < 22), 0.5 + 11.5 * (T - 2) / 20, np.nan)
AT = (3.5, 5.0, 9.0)


def test_the_truth_fits_even_on_a_slow_drift():
    y = chain().simulate(U, RATE) + 0.05 + 0.01 * T
    assert all(s.fit > 99.99 for s in time_check(chain(), U, y, RATE, F, AT))


def test_the_fit_falls_with_the_error_of_the_model():
    y = chain().simulate(U, RATE)
    fits = [
        min(s.fit for s in time_check(chain(delay), U, y, RATE, F, AT))
        for delay in (0.010, 0.012, 0.016, 0.024)
    ]
    assert fits == sorted(fits, reverse=True)
    assert fits[-1] < 50


def test_every_stretch_is_where_the_sweep_passed():
    for s in time_check(chain(), U, U, RATE, F, AT):
        assert isinstance(s, Stretch)
        assert np.interp(s.time.mean(), T[1000:11000], F[1000:11000]) == pytest.approx(
            s.frequency, rel=0.01
        )


def test_what_the_sweep_did_not_pass_is_refused():
    (found,) = time_check(chain(), U, U, RATE, F, (20.0,))
    assert isinstance(found, NoStretch)
    assert "did not pass" in found.reason


def test_a_record_that_ends_too_early_is_refused():
    (found,) = time_check(chain(), U[:1500], U[:1500], RATE, F[:1500], (1.0,))
    assert isinstance(found, NoStretch)


def test_the_fit_of_a_thing_with_itself_is_hundred_and_of_its_mean_is_zero():
    y = np.random.default_rng(1).standard_normal(100)
    assert fit_percent(y, y) == 100
    assert fit_percent(y, np.full(100, y.mean())) == pytest.approx(0, abs=1e-9)

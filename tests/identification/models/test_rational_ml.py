"""Maximum likelihood: the truth comes back, as surely as it says, whatever the units."""

import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from slipbench.identification.models.rational_ml import fit_order
from slipbench.identification.models.stable_rational import Order, evaluate
from slipbench.identification.response.independent_lines import (
    KnownPath,
    NoRational,
    freedom,
    independent_lines,
    without,
)
from slipbench.identification.response.local_polynomial import sweep_response
from tests.identification.response.known_lines import chain, lines
from tests.identification.synthetic_recording import sweep

ORDER = Order(3, 0)
SEEDS = range(200)


@given(poles=st.integers(1, 6), zeros=st.integers(0, 5), seed=st.integers(0, 100))
@settings(max_examples=25, deadline=None)
def test_the_jacobian_is_the_derivative(poles, zeros, seed):
    order, rng = Order(poles, min(zeros, poles)), np.random.default_rng(seed)
    s, x = 1j * np.linspace(0.1, 1.5, 7), rng.normal(0, 0.5, order.size)
    slopes = evaluate(x, s, order)[1]
    for k, h in enumerate(1e-6 * np.eye(order.size)):
        numeric = (evaluate(x + h, s, order)[0] - evaluate(x - h, s, order)[0]) / 2e-6
        np.testing.assert_allclose(slopes[:, k], numeric, rtol=1e-4, atol=1e-7)


@given(delay=st.floats(0, 0.03), damping=st.floats(0.1, 0.6), corner=st.floats(5, 30))
@settings(max_examples=20, deadline=None)
def test_without_noise_the_truth_comes_back(delay, damping, corner):
    found = fit_order(lines(chain(delay, damping, corner), noise=1e-6, seed=3), ORDER)
    assert found.model.delay == pytest.approx(delay, abs=2e-5)
    assert min(abs(m.frequency - 8.6) for m in found.modes) < 0.01


@given(pace=st.floats(0.01, 100), gain=st.floats(1e-3, 1e3))
@settings(max_examples=10, deadline=None)
def test_another_unit_of_time_or_of_output_changes_nothing_else(pace, gain):
    one = lines(chain())
    two = replace(
        one, frequency=one.frequency * pace, value=one.value * gain, deviation=one.deviation * gain
    )
    a, b = fit_order(one, ORDER), fit_order(two, ORDER)
    assert b.chi_square == pytest.approx(a.chi_square, rel=1e-5)
    assert b.model.delay * pace == pytest.approx(a.model.delay, rel=1e-3)


@pytest.fixture(scope="module")
def fits():
    return [fit_order(lines(chain(), seed=seed), ORDER) for seed in SEEDS]


def test_intervals_cover_the_truth_as_often_as_they_say(fits):
    modes = [f.modes[0] for f in fits]
    delay = [abs(f.model.delay - 0.010) < 1.96 * f.delay_deviation for f in fits]
    frequency = [abs(m.frequency - 8.6) < 1.96 * m.frequency_deviation for m in modes]
    damping = [abs(m.damping - 0.32) < 1.96 * m.damping_deviation for m in modes]
    for covered in (delay, frequency, damping):
        assert 0.90 <= np.mean(covered) <= 0.985


def test_the_band_of_the_model_covers_the_true_gain_and_phase(fits):
    f = np.array([1.0, 5.0, 8.6, 11.5])
    truth = chain().response(f)
    ratio = np.array([fit.model.response(f) / truth for fit in fits])
    gain = np.abs(np.abs(ratio) - 1) * np.abs(truth) < [fit.band(f) for fit in fits]
    phase = np.abs(np.angle(ratio)) < [fit.phase_band(f) for fit in fits]
    assert 0.90 <= np.mean(gain) <= 0.985
    assert 0.90 <= np.mean(phase) <= 0.985


def test_chi_square_is_chi_square(fits):
    adequate = [fit.adequate for fit in fits]
    assert stats.kstest(adequate, "uniform").pvalue > 0.01
    assert np.mean([fit.chi_square_ratio for fit in fits]) == pytest.approx(1.0, abs=0.05)


def test_a_model_that_is_too_small_says_so_and_calls_the_lag_a_delay():
    found = fit_order(lines(chain()), Order(2, 0))
    assert found.adequate < 1e-6
    assert found.model.delay > 0.016


def test_no_start_and_no_noise_makes_it_unstable():
    for seed in range(20):
        assert fit_order(lines(chain(), noise=0.3, seed=seed), Order(5, 3)).model.stable


def test_a_fit_takes_less_than_a_fifth_of_a_second():
    taken = []
    for order in (ORDER, Order(4, 1), Order(6, 5)):
        start = time.process_time()
        fit_order(lines(chain()), order)
        taken.append(time.process_time() - start)
    assert np.median(taken) < 0.2


def test_a_held_delay_is_held():
    assert fit_order(lines(chain()), ORDER, delay=0.008).model.delay == pytest.approx(0.008)


def test_the_rest_of_a_response_is_fitted_without_its_known_path():
    path = KnownPath(lags=(0.003,), leads=(0.001,), delay=0.002)
    found = fit_order(without(lines(chain()), path), Order(4, 1)).model
    f = np.array([2.0, 6.0, 10.0])
    np.testing.assert_allclose(found.response(f) * path.response(f), chain().response(f), rtol=0.02)


def test_a_stride_apart_the_lines_of_a_sweep_are_independent():
    rate, t = 200.0, np.arange(0, 24, 1 / 200.0)
    u, z = sweep(t - 2, 20.0), []
    for seed in range(60):
        noise = np.random.default_rng(seed).standard_normal(t.size)
        got = independent_lines(sweep_response(u, u + 0.5 * noise, rate, (0.5, 15.0)))
        z.append((got.value - 1) / got.deviation)
    z = np.array(z)
    together = np.mean(z[:, 1:] * np.conj(z[:, :-1]))
    assert abs(together) < 0.12
    assert np.mean(np.abs(z) ** 2) == pytest.approx(got.inflation, abs=0.12)


def test_the_quantile_tells_its_degrees_of_freedom():
    for n in (2, 6, 42):
        assert freedom(stats.t.ppf(0.975, n)) == pytest.approx(n, rel=1e-4)
    assert freedom(1.959964) == np.inf


def test_too_few_lines_are_refused_in_words():
    t = np.arange(0, 24, 1 / 200.0)
    found = sweep_response(
        sweep(t - 2, 20.0), np.random.default_rng(1).standard_normal(t.size), 200.0, (0.5, 15.0)
    )
    got = independent_lines(found)
    assert isinstance(got, NoRational)
    assert "reliable" in got.reason


def test_what_drifts_below_the_band_is_found_and_does_not_move_the_mode():
    """A pole at 0.17 beside a zero at 0.10 1/s, as the speed gives them."""
    one, two = lines(chain(), noise=1e-5), lines(chain(), noise=1e-5)
    s = 2j * np.pi * two.frequency
    two = replace(two, value=two.value * (s + 0.10) / (s + 0.17))
    still, moved = fit_order(one, ORDER), fit_order(two, ORDER)
    assert moved.drift[0] == pytest.approx(-0.07, abs=0.002)
    assert moved.modes[0].frequency == pytest.approx(still.modes[0].frequency, rel=2e-4)
    assert moved.model.delay == pytest.approx(still.model.delay, abs=2e-5)
    np.testing.assert_allclose(moved.response(two.frequency), two.value, rtol=1e-3)


def test_where_nothing_drifts_its_interval_holds_none(fits):
    held = [abs(fit.drift[0]) < 1.96 * fit.drift[1] for fit in fits]
    assert 0.90 <= np.mean(held) <= 0.985

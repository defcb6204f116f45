"""Intervals hold where the gain errors of neighbouring lines are correlated, and where they are not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from slipbench.identification.models.rational_ml import ACROSS, fit_order, mixed
from slipbench.identification.models.serial_correlation import LENGTH, serial_covariance
from slipbench.identification.models.stable_rational import Order
from tests.identification.response.known_lines import chain, lines

SEEDS = range(120)
N, NOISE = 26, 0.01
FREQUENCY = np.linspace(0.8, 12.0, N)
SMOOTH = 0.25  # variance of the smooth gain errors over that of the white ones


def swept(seed):
    """Lines with white errors and gain errors that are smooth along frequency."""
    white = lines(chain(), NOISE, seed, n=N)
    rng = np.random.default_rng(10_000 + seed)
    away = FREQUENCY[:, None] - FREQUENCY
    spacing = FREQUENCY[1] - FREQUENCY[0]
    K = np.exp(-((away / spacing / LENGTH) ** 2) / 2) + 1e-9 * np.eye(N)
    one = np.linalg.cholesky(K) @ rng.standard_normal(N)
    true = chain().response(FREQUENCY)
    smooth = 2 * np.sqrt(SMOOTH / 2) * NOISE * 0.17 * one  # four times the expected variance
    return replace(white, value=white.value + smooth * true / np.abs(true))


def coverage(serial):
    true = np.abs(chain().response(FREQUENCY))
    held = []
    for seed in SEEDS:
        fit = fit_order(replace(swept(seed), serial=serial), Order(3, 0))
        held.append(np.mean(np.abs(np.abs(fit.response(FREQUENCY)) - true) < fit.band(FREQUENCY)))
    return np.mean(held)


def test_correlated_errors_are_in_the_intervals():
    assert coverage(SMOOTH) > coverage(0.0)
    assert coverage(4 * SMOOTH) == pytest.approx(0.95, abs=0.03)


@pytest.mark.parametrize("seed", range(40))
def test_smooth_errors_are_never_larger_than_all_residuals(seed):
    """Nine lines beside eight parameters tell nothing of the smooth part, and divide by nothing."""
    rng = np.random.default_rng(seed)
    n, p = 9, 8
    value, residual = (rng.standard_normal(n) + 1j * rng.standard_normal(n) for _ in range(2))
    powers = np.linspace(-1, 1, n)[:, None] ** np.arange(p // 2)  # slopes are smooth themselves
    turn = (value / np.abs(value))[:, None]
    slopes = np.hstack((powers * turn, 1j * powers * turn))
    J = np.vstack((slopes.real, slopes.imag))
    inner = np.linalg.inv(J.T @ J)
    weight = np.ones(n)
    found = serial_covariance(value, residual, slopes, inner, weight, 1.0)
    energy = float(np.sum(np.abs(residual) ** 2))
    largest = np.max(np.abs(value)) ** 2 / np.mean(np.abs(value) ** 2) * n
    assert np.all(np.diag(found) <= np.diag(inner) * (1 + 2 * energy / (2 * n - p) * largest))
    assert np.all(np.diag(found) >= np.diag(inner) * (1 - 1e-9))


def test_the_half_width_of_a_mixture_holds_95_percent_of_it():
    rng = np.random.default_rng(3)
    own, other, away, weight = 2.0, 5.0, 3.0, 0.3
    half = mixed(np.array([ACROSS * own]), [(weight, np.array([ACROSS * other]), np.array([away]))])
    from_other = rng.random(200_000) < weight
    drawn = np.where(
        from_other, away + other * rng.standard_normal(200_000), own * rng.standard_normal(200_000)
    )
    assert np.mean(np.abs(drawn) <= half[0]) == pytest.approx(0.95, abs=0.003)


def test_an_order_of_small_weight_does_not_widen_the_interval_without_bound():
    own = np.array([1.0])
    far = [(0.02, np.array([100.0]), np.array([0.0]))]
    assert mixed(own, far)[0] < 1.3
    assert mixed(own, [])[0] == 1.0
    assert mixed(own, [(0.5, own, np.zeros(1))])[0] == pytest.approx(1.0, rel=1e-6)


def test_residuals_below_a_cautious_bound_narrow_the_intervals():
    quiet = lines(chain(), NOISE, 1, n=N)
    bound = 0.05
    cautious = replace(
        quiet, deviation=np.hypot(quiet.deviation, bound * np.abs(quiet.value)), floor=bound
    )
    unaware = replace(cautious, floor=0.0)
    wide, narrow = (fit_order(one, Order(3, 0)).band(FREQUENCY) for one in (unaware, cautious))
    assert np.all(narrow < wide)
    assert stats.gmean(narrow / wide) < 0.7

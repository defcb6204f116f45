"""Batch computations for many curves and effects equal the definition one by one."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy import linalg, signal

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.curves.injection import places
from slipbench.identification.mismatch.curves.scan import RIDGE, _shrunk, enough, scan_curves
from slipbench.identification.mismatch.curves.trace import (
    between_knots,
    impulse_responses,
    responses_to,
    sensors_as_places,
)
from slipbench.identification.mismatch.curves.whitened import SHORT, Waveforms, WhitenedResponses
from slipbench.identification.mismatch.fit.calibrate import start_fit
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.stack import whiten_and_stack
from slipbench.identification.mismatch.fit.variance_inflation import amplitude_p
from slipbench.identification.mismatch.fit.whitening import DOUBTED, Whitener, whitener
from slipbench.identification.mismatch.naming.candidates import candidates
from slipbench.identification.mismatch.naming.score import HINT, placebo_locations, scores
from slipbench.identification.mismatch.simulation.regressor import half_range
from slipbench.identification.mismatch.simulation.sampling import Grid
from slipbench.plant.effects.backlash import Backlash
from slipbench.plant.effects.driveline_loss import DrivelineLoss
from slipbench.plant.effects.wet_patch import WetPatch
from tests.identification.mismatch.conditions import erring, system
from tests.identification.motorcycle_recording import Ride, ride

RIDES = (
    Ride("sweep", 2, 1400.0, 0.04, 0.5, 9.0, seconds=5.0, seed=41),
    Ride("square", 2, 1100.0, 0.05, 0.9, seconds=4.5, seed=42),
)
NEAR = 1e-8
WELL_CONDITIONED = 30.0
"""Condition number of the noise above which the ridge (1e-4) exceeds its smallest part."""
"""Relative: sums in another order, of which large parts cancel."""


@cache
def linear() -> Linearization:
    true = replace(erring(5), effects=(Backlash(slack=20e-3),))
    model = begin(system(), [system().prepare(ride(true, r)) for r in RIDES], ()).training
    return Linearization.of(start_fit(model, model.origin()))


@given(st.integers(0, 2**32 - 1), st.integers(1, 2 * SHORT), st.integers(0, 30))
def test_courses_through_a_filter_are_their_convolution(seed, memory, lost):
    rng = np.random.default_rng(seed)
    inputs, response = rng.standard_normal((90, 3)), rng.standard_normal((memory, 2))
    found = Waveforms([inputs]).filtered(0, response, lost)
    assert found.shape == (90 - lost, 2, 3)
    for output in range(2):
        for column in range(3):
            full = np.convolve(inputs[:, column], response[:, output])[lost:90]
            assert np.allclose(found[:, output, column], full, rtol=0.0, atol=1e-11)


@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.integers(0, 5), st.integers(0, 4))
def test_a_whitened_row_is_the_innovation_of_the_noise_model(seed, outputs, order, columns):
    rng = np.random.default_rng(seed)
    white = whitener([rng.standard_normal((80, outputs)).cumsum(axis=0)], order)
    series = rng.standard_normal((20, outputs, columns) if columns else (20, outputs))
    found = white.innovations(series)
    assert found.shape == (20 - order, *series.shape[1:])
    for t in range(order, 20):
        linearized = sum(white.lags[k] @ series[t - 1 - k] for k in range(order))
        now = white.inverse @ (series[t] - linearized)
        assert np.allclose(found[t - order], now, atol=1e-9 * np.abs(white.inverse).max())


@given(st.floats(-0.95, 0.95), st.integers(1, 12), st.integers(1, 4))
def test_whitening_undoes_the_covariance_of_a_series_from_its_first_row_on(root, rows, order):
    """Of e_t = root e_(t-1) + n_t, which has the covariance root^|t - s| / (1 - root^2)."""
    lags = np.zeros((order, 1, 1))
    lags[0] = root
    covariance = linalg.toeplitz(root ** np.arange(rows)) / (1.0 - root**2)
    stationary = linalg.toeplitz(root ** np.arange(order)) / (1.0 - root**2)
    start = np.linalg.inv(np.linalg.cholesky(stationary))
    white = Whitener(lags, np.eye(1), start)
    matrix = white(np.eye(rows)[:, None, :])[:, 0]
    assert np.allclose(matrix @ covariance @ matrix.T, np.eye(rows), atol=1e-9)
    assert white.log_determinant(rows) == pytest.approx(np.linalg.slogdet(covariance)[1], abs=1e-9)


@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.integers(1, 6))
def test_the_noise_model_knows_how_first_rows_hang_together(seed, outputs, order):
    """First rows of new recordings whiten to unit variance, up to the factor DOUBTED."""
    rng = np.random.default_rng(seed)
    mixed = rng.standard_normal((outputs, outputs))
    assume(np.linalg.cond(mixed) < WELL_CONDITIONED)

    def drawn(rows):
        noise = rng.standard_normal((rows + 100, outputs)) @ mixed
        return signal.lfilter([1.0], [1.0, -0.8], noise, axis=0)[100:]

    white = whitener([drawn(6000)], order)
    openings = DOUBTED * np.array([white(drawn(order)) for _ in range(400)])
    assert np.mean(openings**2) == pytest.approx(1.0, abs=0.35)


@given(st.integers(0, 2**32 - 1), st.integers(2, 9), st.booleans())
def test_shares_of_knots_in_bins_are_the_means_of_the_broken_lines(seed, count, scaled):
    rng = np.random.default_rng(seed)
    grid = Grid(rows=70, start=0.01, bins=11, width=0.005, step=1e-3)
    knots = np.sort(rng.standard_normal(count))
    z, by = 1.5 * rng.standard_normal((2, 70))
    z[rng.random(70) < 0.1] = knots[rng.integers(count)]
    found = between_knots(grid, z, knots, by if scaled else None)
    for knot, line in enumerate(np.eye(count)):
        column = np.interp(z, knots, line) * (by if scaled else 1.0)
        assert np.allclose(found[:, knot], grid.binned(column), atol=1e-12)


def test_whitened_answers_are_the_answers_whitened():
    """For every place of the motion and a sensor, of all curves side by side."""
    fit, tents = linear().fit, {}
    whitened = WhitenedResponses(fit)
    rng = np.random.default_rng(6)
    for drive in fit.model.partition.subsystems:
        tents[drive] = [rng.standard_normal((r.grid.bins, 5)) for r in fit.model.records]
    for place in (*places(fit), *sensors_as_places(fit)):
        inputs = tents[place.subsystem]
        one = whiten_and_stack(
            fit.model, fit.noise, responses_to(impulse_responses(fit, place), inputs)
        )
        many = whitened.columns(place, Waveforms(inputs))
        assert np.abs(one).max() > 0.0, place
        assert np.abs(many - one).max() <= NEAR * np.abs(one).max(), place


def test_a_curve_fitted_among_many_is_the_curve_fitted_alone():
    linearized, whitened = linear(), WhitenedResponses(linear().fit)
    fit, predicted_held_out = linearized.fit, 0
    for tested in scan_curves(linearized, WhitenedResponses(fit)):
        place = tested[0].place
        reply = impulse_responses(fit, place)
        for found in tested[::10]:
            tents = whitened.unit_disturbances(
                place.subsystem, {found.regressor: found.knots}
            ).disturbances
            z = np.concatenate(
                [s[found.regressor] for _, s in whitened.regressors_of(place.subsystem)], axis=-1
            )
            units = 1.0 / half_range(found.regressor, z, found.knots)
            waveforms = [place.size * h * units for h in tents]
            columns = whiten_and_stack(fit.model, fit.noise, responses_to(reply, waveforms))
            projected = linearized.nuisances.project_out(columns)
            normal, gradient = projected.T @ projected, projected.T @ linearized.residuals
            values = np.linalg.solve(normal + RIDGE * np.eye(len(normal)), gradient)
            gain = 0.5 * float(values @ gradient)
            assert found.log_likelihood_gain == pytest.approx(gain, rel=1e-6, abs=1e-6), (
                found.regressor
            )
            if gain > enough(len(values)):
                values = _shrunk(normal, gradient, columns)
            assert np.allclose(projected @ (found.values / units), projected @ values, atol=1e-5)
            predicted_held_out += found.cross_predicted is not None
    assert predicted_held_out > 0


def test_an_effect_scored_among_many_is_the_effect_scored_alone():
    linearized = linear()
    evaluated = [c for kind in (Backlash, DrivelineLoss, WetPatch) for c in candidates(kind, {})]
    hinted = 0
    for c, found in zip(evaluated, scores(linearized, evaluated), strict=True):
        signature = linearized.effect_response(c)
        projected = linearized.nuisances.project_out(signature)
        energy, correlation = float(projected @ projected), float(projected @ linearized.residuals)
        if energy < 1e-6:
            assert found.visible_gain == 0.0, c.name
            continue
        assert found.visible_gain == pytest.approx(0.5 * energy, rel=1e-6), c.name
        assert found.amplitude == pytest.approx(correlation / energy, rel=1e-6), c.name
        assert found.kept == pytest.approx(energy / float(signature @ signature), rel=1e-6)
        if found.log_likelihood_gain > HINT:
            least = c.negligible_size / abs(c.size)
            p = amplitude_p(
                projected,
                linearized.residuals,
                linearized.clusters,
                linearized.fit.variance_inflation,
                least,
            )
            assert found.p == pytest.approx(p, rel=1e-6)
            hinted += 1
    assert hinted > 0


def test_signatures_along_the_road_that_are_kept_tell_what_new_ones_tell():
    evaluated = list(candidates(WetPatch, {}))[:4]
    kept = {}
    scores(linear(), evaluated, kept)
    assert kept.keys() == set(evaluated)
    anew, again = (
        placebo_locations(linear(), evaluated),
        placebo_locations(linear(), evaluated, kept),
    )
    for one, other in zip(anew, again, strict=True):
        assert one.at == other.at
        assert np.allclose(one.energy, other.energy, rtol=1e-9)
        assert np.allclose(one.amplitude, other.amplitude, rtol=1e-6)
        assert one.distinct_share == pytest.approx(other.distinct_share)


@pytest.mark.parametrize("seed", range(3))
def test_a_push_on_some_rows_is_that_of_columns_which_are_zero_elsewhere(seed):
    print(f"seed {seed}")
    linearized, rng = linear(), np.random.default_rng(seed)
    columns = rng.standard_normal((len(linearized.fit.whitened_residuals), 3))
    rows = rng.random(len(columns)) < 0.3
    for some, full in zip(
        linearized.energy_and_correlation(columns, rows),
        linearized.energy_and_correlation(columns * rows[:, None]),
        strict=True,
    ):
        assert np.allclose(some, full, rtol=1e-9)

"""Steps of the fit stay within their bounds."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.fit import held_out as held_out_module
from slipbench.identification.mismatch.fit.calibrate import (
    at_prior_mean,
    beyond_prior,
    calibrate,
    start_fit,
)
from slipbench.identification.mismatch.fit.fitting import Fit, renoised, with_effects
from slipbench.identification.mismatch.fit.held_out import contradicted
from slipbench.identification.mismatch.fit.least_squares_start import (
    least_squares_start,
    other_minimum,
)
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.optimize import after_step, optimize
from slipbench.identification.mismatch.fit.refit import WORTH_AGAIN, relinearized
from slipbench.identification.mismatch.fit.sensitivity import coordinates_of
from slipbench.identification.mismatch.fit.slopes import Slopes
from slipbench.identification.mismatch.fit.stack import Nuisances, bounded
from slipbench.identification.mismatch.naming.candidates import candidates
from slipbench.identification.mismatch.naming.fits import (
    by_score,
    fits_from_the_file,
    fitted,
    promising_fits,
)
from slipbench.identification.mismatch.naming.score import screen
from slipbench.identification.mismatch.thresholds import CONFIRMED
from slipbench.plant.effects.backlash import Backlash
from slipbench.plant.effects.driveline_loss import DrivelineLoss
from slipbench.plant.effects.load_transfer import LoadTransfer
from slipbench.plant.errors import PlantError
from tests.identification.mismatch.conditions import erring, system
from tests.identification.motorcycle_recording import Ride, ride

LEARN = Ride("sweep", 2, 1400.0, 0.04, 0.5, 9.0, seconds=4.0, seed=31)
PROVE = Ride("square", 2, 1100.0, 0.05, 0.9, seconds=4.0, seed=32)


@cache
def ready(*effects):
    true = replace(erring(5), effects=effects)
    return begin(system(), *([system().prepare(ride(true, t))] for t in (LEARN, PROVE)))


@cache
def base(*effects) -> Fit:
    model = ready(*effects).training
    return calibrate(model, model.origin())


def test_a_step_along_diverging_sensitivities_is_refused_as_a_point_that_cannot_be_run() -> None:
    """A filling time below the integration step gave two sensitivities of 1e32, with one direction."""
    normal = np.array([[2.0, 0.0, 0.0], [0.0, 1e64, 1e63], [0.0, 1e63, (1.0 - 1e-8) * 1e62]])
    with pytest.raises(PlantError, match="sensitivities diverge") as refused:
        bounded(normal, np.ones(3), np.full(3, -2.0), np.full(3, 2.0))
    assert refused.value.remedy


@pytest.mark.parametrize("diverged", [np.inf, np.nan])
def test_sensitivities_that_are_not_finite_are_refused_in_the_same_way(diverged) -> None:
    """Regression: they ended an analysis with a ValueError."""
    columns = np.ones((4, 2))
    columns[2, 1] = diverged
    with pytest.raises(PlantError, match="sensitivities diverge"):
        Nuisances(columns).fit(np.ones(4))
    normal = columns.T @ columns
    with pytest.raises(PlantError, match="sensitivities diverge"):
        bounded(normal, np.ones(2), np.full(2, -2.0), np.full(2, 2.0))


@pytest.mark.parametrize("seed", range(5))
def test_a_bounded_step_is_the_best_within_its_bounds(seed):
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    nuisances = Nuisances(rng.standard_normal((200, 6)))
    series = nuisances.columns @ (5.0 * rng.standard_normal(6)) + rng.standard_normal(200)

    def cost(z):
        residual = series - nuisances.columns @ z
        return residual @ residual + z @ z

    low, high = np.full(6, -2.0), np.full(6, 2.0)
    normal, correlation = nuisances.normal, nuisances.columns.T @ series
    held = bounded(normal, correlation, low, high)
    assert (held >= low - 1e-9).all()
    assert (held <= high + 1e-9).all()
    assert (np.abs(held) > 1.99).any()
    others = np.clip(held + 0.1 * rng.standard_normal((500, 6)), low, high)
    assert cost(held) <= min(map(cost, others)) + 1e-9
    wide = bounded(normal, correlation, low - 100.0, high + 100.0)
    assert np.allclose(wide, nuisances.fit(series))


@pytest.mark.parametrize("seed", range(5))
def test_what_calibration_hides_only_by_leaving_its_priors_is_seen(seed):
    """After projecting out nuisances, a column's gain equals the gain of a joint fit."""
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    nuisances = Nuisances(rng.standard_normal((200, 6)))
    hidden = nuisances.columns[:, 0] + 0.1 * rng.standard_normal(200)
    series = 8.0 * hidden + rng.standard_normal(200)

    def least(columns, weights):
        z = np.linalg.solve(columns.T @ columns + np.diag(weights), columns.T @ series)
        residual = series - columns @ z
        return 0.5 * (residual @ residual + weights @ z**2), z, residual

    before, z, residual = least(nuisances.columns, np.ones(6))
    after, *_ = least(np.column_stack((nuisances.columns, hidden)), np.array([1.0] * 6 + [0.0]))
    off, adjusted = nuisances.project_out(hidden), nuisances.projected_residuals(residual, z)
    projected_gain = 0.5 * (off @ adjusted) ** 2 / (off @ off)
    assert projected_gain > 10.0
    assert projected_gain == pytest.approx(before - after, rel=1e-9)


def test_a_settled_fit_stays_where_it_is():
    fit = base()
    again = optimize(fit)
    assert abs(again.score - fit.score) < 1.0
    assert np.allclose(again.point.x, fit.point.x, atol=0.3)


def test_slopes_taken_elsewhere_are_those_by_values():
    """Drag enters linearly, so its derivative by value is the same at 1.35 times the drag."""
    fit = base()
    place = [k.name for k in fit.model.known].index("drag_area")
    step = np.zeros(coordinates_of(fit.point).size)
    step[place] = 0.35 / fit.model.known[place].scale
    away = after_step(fit, step, np.zeros(0))
    assert away is not None
    measured = relinearized(away).nuisances.columns[:, place]
    here, scaled = (f.nuisances.columns[:, place] for f in (fit, away))
    assert np.linalg.norm(scaled - measured) < 0.05 * np.linalg.norm(measured)
    assert np.linalg.norm(here - measured) > 0.15 * np.linalg.norm(measured)


def test_no_number_is_led_farther_off_than_any_file_errs():
    model = ready(Backlash(slack=20e-3)).training
    assert np.abs(base(Backlash(slack=20e-3)).point.x).max() <= model.system.coordinate_bound + 1e-9


def test_held_out_recordings_contradict_what_they_would_show_and_do_not():
    bare = base(Backlash(slack=8e-3))
    held_out = ready(Backlash(slack=8e-3)).held_out
    right = optimize(_with(bare, Backlash(slack=8e-3)))
    wrong = _with(bare, DrivelineLoss(loss=0.2))
    assert not contradicted(bare, right, held_out)
    against = contradicted(bare, wrong, held_out)
    assert against is not None
    assert against.name == "driveline_loss"
    assert against.gain < against.least


def test_held_out_recordings_that_need_an_effect_to_be_simulated_confirm_it(monkeypatch):
    """Without it the improved parameters cannot be simulated: held-out data confirm it."""
    bare, held_out = base(Backlash(slack=8e-3)), ready(Backlash(slack=8e-3)).held_out
    right = optimize(_with(bare, Backlash(slack=8e-3)))

    def grows(*_, **__):
        raise PlantError("it grows without bound", "here", "numbers", "none", "smaller steps")

    monkeypatch.setattr(held_out_module, "change", grows)
    assert not contradicted(bare, right, held_out)
    against = contradicted(bare, _with(bare, DrivelineLoss(loss=0.2)), held_out)
    assert against is not None
    assert against.least == CONFIRMED


def _with(fit: Fit, effect) -> Fit:
    return replace(fit, point=replace(fit.point, effects=(effect,)))


PRESSED = (
    Ride("sweep", 2, 1440.0, 0.04, 0.5, 13.0, seconds=6.0, seed=31),
    Ride("square", 2, 1050.0, 0.09, 0.9, seconds=6.0, seed=32),
)


@cache
def calibrated_without(seed: int, height: float) -> Fit:
    print(f"seed {seed}")
    true = replace(erring(seed), effects=(LoadTransfer(height=height),))
    model = begin(system(), [system().prepare(ride(true, t)) for t in PRESSED], []).training.coarse
    return calibrate(model, model.origin())


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_effect_is_found_although_calibration_has_made_up_for_it(seed):
    """Calibration overestimates the load: a fit from there recovers a part of the effect."""
    height = 0.6
    base = calibrated_without(seed, height)
    assert np.abs(base.point.x).max() > 1.5
    (kind,) = candidates(LoadTransfer)
    here = promising_fits(
        base, screen(Linearization.of(base), [LoadTransfer]).scores, lambda _: None
    )
    found = by_score([*here, *fits_from_the_file(base, [LoadTransfer], lambda _: None)])[0]
    (named,) = found.effects
    assert named.effect().height == pytest.approx(height, rel=0.2)
    assert found.score - base.score > 1.05 * nats_from_here(base, kind)


def nats_from_here(base: Fit, kind) -> float:
    return optimize(with_effects(base, (kind,))).score - base.score


def test_sensitivities_of_where_a_fit_began_do_not_lead_it_to_its_end():
    base = calibrated_without(1, 0.6)
    (kind,) = candidates(LoadTransfer)
    found = fitted(base, kind)
    assert found.score - base.score > 1.2 * nats_from_here(base, kind)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_no_part_of_an_optimization_lowers_the_score(seed):
    """At the noise model of the start a fit may lead away from the best one with its own noise."""
    base = calibrated_without(seed, 0.6)
    shift = 0.5 * np.random.default_rng(seed).standard_normal(coordinates_of(base.point).size)
    for start in (base, after_step(base, shift, np.zeros(0))):
        assert start is not None
        assert optimize(renoised(start)).score >= renoised(start).score


@pytest.mark.parametrize("refit_noise", [False, True])
def test_the_predicted_gain_is_largest_for_the_full_step(refit_noise):
    base = calibrated_without(1, 0.6)
    slopes = Slopes.of(base, refit_noise)
    full = np.linalg.solve(slopes.normal, slopes.slope)
    assert slopes.gain(full) == pytest.approx(0.5 * slopes.slope @ full)
    assert slopes.gain(np.zeros_like(full)) == 0.0
    for share in (0.4, 0.9, 1.1, 2.0):
        assert slopes.gain(share * full) < slopes.gain(full)


def test_plain_least_squares_in_the_same_minimum_returns_the_known_fit():
    base = calibrated_without(1, 0.6)
    assert other_minimum(base, base) is base
    uncalibrated = start_fit(base.model, base.model.origin())
    assert other_minimum(uncalibrated, uncalibrated).score > uncalibrated.score


def test_a_start_from_the_file_keeps_what_the_file_does_not_tell():
    base = calibrated_without(1, 0.6)
    begun = at_prior_mean(base)
    assert not beyond_prior(begun)
    assert begun.point.q is base.point.q
    for x, was, known in zip(begun.point.x, base.point.x, begun.model.known, strict=True):
        assert x == (was if known.of_clock else 0.0)


def test_calibration_ends_no_lower_than_where_plain_least_squares_lead():
    """A fit with its own noise model only ends at 4 deviations, with a lower score."""
    base = calibrated_without(1, 0.6)
    plain = least_squares_start(start_fit(base.model, base.model.origin()))
    assert base.score >= plain.score - 2.0 * WORTH_AGAIN

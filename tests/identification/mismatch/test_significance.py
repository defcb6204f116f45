"""When an effect is significant: by its magnitude, and a limit by its response."""

import numpy as np
import pytest
from scipy import stats

from slipbench.identification.mismatch.fit.calibrate import start_fit
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.naming.candidates import candidates
from slipbench.identification.mismatch.naming.fits import fitted as best_fit
from slipbench.identification.mismatch.naming.fits import fitted_without
from slipbench.identification.mismatch.naming.interval import likelihood_ratio_p, significance
from slipbench.identification.mismatch.simulation.model import simulate
from slipbench.plant.effects.driveline_loss import DrivelineLoss
from slipbench.plant.effects.load_transfer import LoadTransfer
from slipbench.plant.effects.rate_limit import RateLimit
from tests.identification.mismatch.test_small import started


def fitted(*effects) -> Fit:
    model = started(*effects).training.coarse
    return start_fit(model, model.origin())


def limited(fit: Fit, limit: float) -> Fit:
    (kind,) = candidates(RateLimit)
    new = kind.resized(kind.size * RateLimit().limit / limit)
    assert isinstance(new, Candidate)
    assert new.effect().limit == pytest.approx(limit)
    return with_effects(fit, (new,))


def fastest(fit: Fit) -> float:
    """Rate of the throttle that is passed for a hundredth of the time."""
    rates = []
    for r in range(len(fit.model.records)):
        step = fit.model.records[r].grid.step
        rates.append(np.abs(np.diff(simulate(fit.model, fit.point, r, "servo")["throttle"]) / step))
    return float(np.quantile(np.concatenate(rates), 0.99))


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_a_limit_that_the_recordings_do_not_show_is_not_certain_however_sure_its_size(share):
    fit = fitted()
    assert significance(limited(fit, share * fastest(fit)), 0) > 0.01


def test_a_limit_that_acts_is_certain_and_found_beside_where_it_was_looked_for():
    true = 0.7 * fastest(fitted())
    found = optimize(limited(fitted(RateLimit(limit=true)), 1.07 * true))
    assert significance(found, 0) < 1e-6
    (candidate,) = found.effects
    assert candidate.effect().limit == pytest.approx(true, rel=0.02)


def test_what_ends_at_the_end_of_its_range_is_as_certain_as_what_it_explains():
    end = LoadTransfer.parameters()[0].high
    (kind,) = candidates(LoadTransfer)
    bare = fitted(LoadTransfer(height=end))
    found = optimize(with_effects(bare, (kind.resized(1e3),)))
    (candidate,) = found.effects
    assert candidate.effect().height > 0.9 * end
    assert found.score - bare.score > 20.0
    assert significance(found, 0) < 1e-6


@pytest.mark.parametrize("loss", [0.01, 0.03])
def test_what_is_lost_without_an_effect_says_the_same_as_its_size_where_both_are_valid(loss):
    (kind,) = candidates(DrivelineLoss)
    found = best_fit(fitted(DrivelineLoss(loss=loss)), kind)
    without = fitted_without(found, 0)
    by_size = significance(found, 0)
    by_loss = likelihood_ratio_p(found, 0, found.score - without.score)
    assert stats.norm.isf(by_loss) == pytest.approx(stats.norm.isf(by_size), rel=0.1)
    assert likelihood_ratio_p(found, 0, 0.0) == 0.5

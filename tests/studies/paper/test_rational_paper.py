"""Equation 4: it finds the truth from any start, and asks for a zero only without the delay."""

import numpy as np
import pytest

from slipbench.identification.models.rational_paper import (
    choose_paper_order,
    equation_error,
    paper_fit,
)
from slipbench.identification.models.stable_rational import Order
from slipbench.identification.models.time_check import NoStretch
from slipbench.identification.response.independent_lines import KnownPath
from slipbench.identification.response.response import FrequencyResponse
from slipbench.studies.paper.claims import Claim
from slipbench.studies.paper.rational_claims import rational_claims, rational_study, time_claims
from slipbench.studies.paper.rational_figures import (
    delay_figure,
    fit_figure,
    order_figure,
    time_figure,
)
from tests.identification.response.known_lines import chain, lines


def response(model, noise=0.01, seed=1, n=40):
    got = lines(model, noise, seed, n)
    return FrequencyResponse(
        "throttle_position",
        "slip",
        got.frequency,
        got.value,
        np.full(n, 0.99),
        got.deviation,
        1.96,
        "known",
    )


@pytest.fixture(scope="module")
def study():
    return rational_study(response(chain(0.0105)), 0.010, KnownPath(delay=0.0005))


def test_the_jacobian_is_the_derivative():
    order, rng = Order(3, 2), np.random.default_rng(1)
    s, x = 1j * np.linspace(0.1, 1.5, 7), rng.normal(0, 0.5, 6)
    slopes = equation_error(x, s, order)[1]
    for k, h in enumerate(1e-6 * np.eye(6)):
        numeric = (equation_error(x + h, s, order)[0] - equation_error(x - h, s, order)[0]) / 2e-6
        np.testing.assert_allclose(slopes[:, k], numeric, rtol=1e-5, atol=1e-8)


def test_the_truth_is_found_from_any_scatter_of_starts():
    for seed in range(5):
        model = paper_fit(lines(chain(), 1e-5), Order(3, 0), 0.010, seed=seed).model
        np.testing.assert_allclose(np.sort(model.poles), np.sort(chain().poles), rtol=5e-3)


def test_an_equal_weight_and_one_by_variance_agree_without_noise():
    data = lines(chain(), 1e-5)
    one, two = (paper_fit(data, Order(3, 0), 0.010, weight).model for weight in (None, np.ones(40)))
    np.testing.assert_allclose(
        one.response(data.frequency), two.response(data.frequency), rtol=1e-3
    )


def test_with_the_delay_it_is_minimum_phase_and_without_it_a_zero_is_needed():
    for seed in range(4):
        data = lines(chain(), seed=seed)
        tried = (Order(3, 0), Order(3, 1), Order(3, 2))
        late = choose_paper_order(data, 0.010, tried=tried)
        early = choose_paper_order(data, 0.0, tried=tried)
        assert any(row.fit.model.minimum_phase for row in late.within())
        assert not any(row.fit.model.minimum_phase for row in early.within())
        assert early.best.fit.cost > 0.9 * late.best.fit.cost


def test_claims_hold_on_a_known_chain(study):
    claims = rational_claims(study)
    assert all(isinstance(claim, Claim) for claim in claims)
    broken = [claim.name for claim in claims if not claim.holds]
    assert broken == []


def test_claims_do_not_hold_where_the_delay_is_another():
    other = rational_study(response(chain(0.020)), 0.010)
    held = {claim.name: claim.holds for claim in rational_claims(other)}
    assert not held["delay_throttle_position"]
    assert not held["delay_interval_throttle_position"]


def test_a_stretch_that_is_not_there_is_a_claim_that_does_not_hold():
    (claim,) = time_claims((NoStretch(3.5, "the sweep did not pass 3.5 Hz"),), 80.0)
    assert not claim.holds
    assert claim.note


def test_figures_are_drawn(study):
    drawn = (
        fit_figure(response(chain()), study, 62.8),
        delay_figure(study),
        order_figure(study),
        time_figure((NoStretch(3.5, "why"), NoStretch(5.0, "why")), 62.8),
    )
    assert all(figure.axes for figure in drawn)

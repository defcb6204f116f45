"""Orders: what the data cannot tell apart is told together, and noise is no resonance."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from slipbench.identification.models.model_order import (
    all_pole,
    choose_order,
    doubted,
    of_likelihood,
    of_residuals,
    orders,
    resolved,
)
from slipbench.identification.models.stable_rational import Order
from tests.identification.response.known_lines import chain, lines

TRIED = (Order(2, 0), Order(3, 0), Order(3, 1), Order(4, 0))


@pytest.fixture(scope="module")
def choices():
    return [choose_order(lines(chain(), seed=seed), TRIED) for seed in range(20)]


def test_the_true_order_is_nearly_always_within_two_nats(choices):
    assert np.mean([Order(3, 0) in [r.order for r in c.within()] for c in choices]) >= 0.9


def test_more_than_one_order_is_within_two_nats(choices):
    assert np.mean([len(c.within()) > 1 for c in choices]) > 0.8


def test_an_order_that_is_too_small_is_never_among_them(choices):
    assert all(Order(2, 0) not in [r.order for r in c.within()] for c in choices)


def test_the_least_is_first_and_at_zero_and_description_length_is_not_larger(choices):
    for choice in choices:
        nats = [row.nats for row in choice.rows]
        assert nats[0] == 0
        assert nats == sorted(nats)
        assert choice.best_by_mdl.order.size <= choice.best.order.size


def test_bands_widen_by_doubt_about_the_order_and_by_nothing_else(choices):
    f = np.linspace(1, 11, 9)
    for choice in choices:
        alone, fit = choice.best_by_mdl.fit, doubted(choice)
        assert np.array_equal(fit.model.poles, alone.model.poles)
        assert sum(w for w, _ in fit.rivals) < 1
        members = [(1 - sum(w for w, _ in fit.rivals), alone), *fit.rivals]
        half, inside = fit.band(f), 0.0
        for w, one in members:  # the band holds 95 % of the mixture of the orders
            apart = np.abs(np.abs(one.response(f)) - np.abs(alone.response(f)))
            ends = [(sign * half - apart) / (one.band(f) / 1.959964) for sign in (1, -1)]
            inside = inside + w * (stats.norm.cdf(ends[0]) - stats.norm.cdf(ends[1]))
        assert inside == pytest.approx(np.full(f.size, 0.95), abs=1e-6)
    single = doubted(choose_order(lines(chain()), (Order(3, 0),)))
    assert not single.rivals


@given(cost=st.floats(1, 1e4), p=st.integers(1, 10), extra=st.integers(1, 5))
def test_every_criterion_punishes_parameters_that_do_not_help(cost, p, extra):
    for score in (of_likelihood, of_residuals):
        small, large = score(cost, p, 60), score(cost, p + extra, 60)
        assert large.fpe > small.fpe
        assert large.mdl - small.mdl > large.aic - small.aic > 0


def test_as_many_parameters_as_samples_predict_nothing():
    assert of_residuals(1.0, 60, 60).fpe == np.inf


def test_orders_are_strictly_proper():
    assert all(order.zeros < order.poles for order in orders())
    assert all(order.zeros == 0 for order in all_pole())


def test_a_resonance_narrower_than_the_lines_is_not_resolved():
    few = lines(chain())
    assert resolved(chain(), few)
    assert not resolved(chain(damping=0.001), few)

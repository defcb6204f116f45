"""Regions of poles and zeros and bands of step responses hold the truth at the stated rate."""

import numpy as np
import pytest
from scipy import stats

from slipbench.identification.models.rational_ml import fit_order
from slipbench.identification.models.roots import roots_with_intervals
from slipbench.identification.models.stable_rational import Order
from slipbench.identification.models.step_response import step_response
from tests.identification.response.known_lines import chain, lines

SEEDS = range(150)
LEAST, MOST = stats.binom.ppf((0.002, 0.998), len(SEEDS), 0.95) / len(SEEDS)
TRUTH = chain(zeros=(-2 * np.pi * 3.0,))


@pytest.fixture(scope="module")
def fits():
    return [fit_order(lines(TRUTH, 0.01, seed, n=60), Order(3, 1)) for seed in SEEDS]


def nearest(roots, value):
    return min(roots, key=lambda one: abs(one.value - value))


@pytest.mark.parametrize("kind", ["complex pole", "real pole", "zero"])
def test_regions_hold_the_true_roots_at_the_stated_rate(fits, kind):
    poles = [p for p in TRUTH.poles if p.imag >= 0]
    true = {
        "complex pole": next(p for p in poles if p.imag > 0),
        "real pole": complex(next(p for p in poles if p.imag == 0).real),
        "zero": complex(TRUTH.zeros[0].real),
    }[kind]
    hits = []
    for fit in fits:
        poles, zeros = roots_with_intervals(fit)
        hits.append(nearest(zeros if kind == "zero" else poles, true).contains(true))
    assert LEAST <= np.mean(hits) <= MOST


def test_the_outline_is_the_edge_of_the_region(fits):
    root = next(one for one in roots_with_intervals(fits[0])[0] if not one.real)
    for point in root.outline():
        assert root.contains(root.value + 0.999 * (point - root.value))
        assert not root.contains(root.value + 1.001 * (point - root.value))


def test_step_bands_hold_the_true_step_at_the_stated_rate(fits):
    inside = []
    for fit in fits[:60]:
        step = step_response(fit, 0.6)
        rate = 1 / step.time[1]
        truth = TRUTH.simulate(np.concatenate(([0.0], np.ones(step.time.size))), rate)[1:]
        late = step.time > 0.03
        inside.append(np.mean(np.abs(truth - step.value)[late] <= step.half_width[late]))
    assert 0.90 <= np.mean(inside) <= 0.985


def test_the_step_ends_at_the_gain_of_zero_frequency(fits):
    step = step_response(fits[0], 5.0)
    assert step.value[0] == 0
    assert step.value[-1] == pytest.approx(fits[0].model.response(np.zeros(1))[0].real, rel=1e-6)


def test_another_plausible_order_widens_the_regions(fits):
    from dataclasses import replace

    other = fit_order(lines(TRUTH, 0.01, 999, n=60), Order(3, 1))
    doubtful = replace(fits[0], rivals=((0.4, other),))
    known, wide = (roots_with_intervals(one)[0][0] for one in (fits[0], doubtful))
    assert np.trace(wide.covariance) > 0.9 * np.trace(known.covariance)
    assert np.max(step_response(doubtful).half_width) > 0

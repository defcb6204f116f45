"""The crank phase is estimated from each recording and identifies a torque ripple."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.crank_phase import (
    Lines,
    _angles,
    at_estimated_angles,
    lines,
)
from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.naming.interval import _over_angles, estimates, significance
from slipbench.plant.effects.compression_torque import CompressionTorque
from tests.identification.mismatch.test_small import started

THREE = CompressionTorque(swing=60.0, cylinders=3)


@cache
def fitted(*effects) -> Fit:
    model = started(*effects).training.coarse
    return calibrate(model, model.origin())


def test_where_nothing_ripples_no_angle_is_read():
    assert not lines(fitted()).plain


def test_a_ripple_is_found_at_its_order_and_told_with_its_size():
    bare = fitted(THREE)
    shown = lines(bare)
    assert shown.plain
    assert shown.orders[np.argmax(shown.nats)] == 1.5
    begun, _ = at_estimated_angles(bare, shown)
    candidate = Candidate(CompressionTorque(cylinders=3), (0.5, 0.0), (3.0,))
    found = optimize(with_effects(begun, (candidate,)))
    swing = estimates(found, 0)[0]
    assert swing.low < THREE.swing < swing.high
    assert swing.value == pytest.approx(THREE.swing, rel=0.04)
    assert significance(found, 0) < 1e-6


def test_what_has_been_read_is_not_read_again():
    bare = fitted(THREE)
    once, aligned = at_estimated_angles(bare, lines(bare))
    twice, _ = at_estimated_angles(once, lines(once), aligned)
    for a, b in zip(once.model.records, twice.model.records, strict=True):
        period = 2 * np.pi / 1.5
        assert (b.turned - a.turned + 0.5 * period) % period == pytest.approx(0.5 * period, abs=0.1)


ORDERS = np.arange(1.0, 7.0)
angles = st.lists(st.floats(-10.0, 10.0), min_size=2, max_size=6).map(np.array)
ripples = st.lists(
    st.complex_numbers(min_magnitude=1.0, max_magnitude=9.0), min_size=6, max_size=6
).map(np.array)


@given(angles, ripples)
def test_all_orders_together_tell_the_angle_within_the_whole_turn(began, ripple):
    """With the same ripple in all recordings, angles are known up to one common angle."""
    amplitude = ripple * np.exp(1j * ORDERS * began[:, None])
    shown = Lines(ORDERS, amplitude, np.ones(amplitude.shape))
    aligned = shown.begun(_angles(shown, None))
    assert np.abs(aligned.amplitude - aligned.amplitude[0]).max() < 1e-9


@given(angles, ripples)
def test_other_recordings_are_begun_like_those_whose_angles_are_known(began, ripple):
    amplitude = ripple * np.exp(1j * ORDERS * began[:, None])
    known = Lines(ORDERS, ripple[None, :], np.ones((1, 6)))
    shown = Lines(ORDERS, amplitude, np.ones(amplitude.shape))
    aligned = shown.begun(_angles(shown, known))
    assert np.abs(aligned.amplitude - ripple).max() < 1e-9


@pytest.mark.parametrize("count", [1, 4, 7])
def test_angles_at_their_best_are_no_better_than_chance(count):
    """z of the sum over recordings, each at its best angle: the resulting p is conservative."""
    print("seed 1")
    rng = np.random.default_rng(1)
    z = np.hypot(*rng.standard_normal((2, 20000, count))).sum(axis=1) / np.sqrt(count)
    p = np.array([_over_angles(float(stats.norm.sf(one)), count) for one in z])
    for level in (0.3, 0.1, 0.01):
        assert np.mean(p < level) < level + 3 * np.sqrt(level / p.size)


def test_a_file_that_knows_the_ripple_foretells_it_once_the_angles_are_read():
    without = fitted(THREE)
    with_ripple = replace(without.model, system=without.model.system.at((), np.empty(0), (THREE,)))
    before = calibrate(with_ripple, with_ripple.origin())
    shown = lines(before)
    assert shown.orders[np.argmax(shown.nats)] == 1.5
    assert at_estimated_angles(before, shown)[0].score > without.score + 100.0

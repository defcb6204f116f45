"""The angle of a crank is read off each recording, and a ripple of its torque is told by it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy import stats

from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.fit.settling import settle
from slipbench.identification.mismatch.fit.turned import begun_at, plainest_turn
from slipbench.identification.mismatch.naming.interval import _over_angles, estimates, significance
from slipbench.plant.effects.compression_torque import CompressionTorque
from tests.identification.mismatch.test_small import started

THREE = CompressionTorque(swing=60.0, cylinders=3)


@cache
def fitted(*effects) -> Fit:
    model = started(*effects).training.coarse
    return calibrate(model, model.origin())


def test_where_nothing_ripples_no_angle_is_read():
    assert plainest_turn(fitted()) is None


def test_a_ripple_is_found_at_its_order_and_told_with_its_size():
    bare = fitted(THREE)
    turn = plainest_turn(bare)
    assert turn is not None
    assert turn.per_turn == 1.5
    begun = begun_at(bare, turn)
    candidate = Candidate(CompressionTorque(cylinders=3), (0.5, 0.0), (3.0,))
    found = settle(with_effects(begun, (candidate,)))
    swing = estimates(found, 0)[0]
    assert swing.low < THREE.swing < swing.high
    assert swing.value == pytest.approx(THREE.swing, rel=0.04)
    assert significance(found, 0) < 1e-6


def test_what_has_been_read_is_not_read_again():
    bare = fitted(THREE)
    turn = plainest_turn(bare)
    once = begun_at(bare, turn)
    twice = begun_at(once, turn)
    for a, b in zip(once.model.records, twice.model.records, strict=True):
        period = 2 * np.pi / turn.per_turn
        assert (b.turned - a.turned + 0.5 * period) % period == pytest.approx(0.5 * period, abs=0.1)


@pytest.mark.parametrize("count", [1, 4, 7])
def test_angles_at_their_best_are_no_better_than_chance(count):
    """z of the sum over recordings, each turned to its best: p so found is never too small."""
    print("seed 1")
    rng = np.random.default_rng(1)
    z = np.hypot(*rng.standard_normal((2, 20000, count))).sum(axis=1) / np.sqrt(count)
    p = np.array([_over_angles(float(stats.norm.sf(one)), count) for one in z])
    for level in (0.3, 0.1, 0.01):
        assert np.mean(p < level) < level + 3 * np.sqrt(level / p.size)


def test_a_file_that_knows_the_ripple_foretells_it_once_the_angles_are_read():
    without = fitted(THREE)
    knows = replace(without.model, system=without.model.system.at((), np.empty(0), (THREE,)))
    before = calibrate(knows, knows.origin())
    turn = plainest_turn(before)
    assert turn is not None
    assert turn.per_turn == 1.5
    assert begun_at(before, turn).score > without.score + 100.0

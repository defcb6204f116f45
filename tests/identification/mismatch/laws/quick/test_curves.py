"""Unnamed physics with memory: mismatch detected, injection point, predictive curve."""

import numpy as np
import pytest

from tests.identification.mismatch.laws.explained import explained, reported
from tests.identification.mismatch.laws.spring import PERIOD, spring, swung

WRONG = ("quadratic.deflection", "asymmetry.deflection", "dead_zone.deflection")
LAG, PLAY = 0.04, 0.3  # s, V


def lagging(force: np.ndarray) -> np.ndarray:
    """Force behind a lag of first order."""
    keep, y, out = np.exp(-PERIOD / LAG), 0.0, np.empty_like(force)
    for k, u in enumerate(force):
        y = keep * y + (1.0 - keep) * u
        out[k] = y
    return out


def playing(force: np.ndarray) -> np.ndarray:
    """Force behind a play."""
    y, out = 0.0, np.empty_like(force)
    for k, u in enumerate(force):
        y = min(max(y, u - PLAY), u + PLAY)
        out[k] = y
    return out


KIND = {lagging: "past", playing: "hysteresis"}


@pytest.fixture(scope="module")
def verdicts(tmp_path_factory):
    nominal = spring(tmp_path_factory.mktemp("spring"))
    return {
        f: explained(nominal, *([swung(seed, felt=f, seconds=6.0)] for seed in (1, 2)), WRONG)
        for f in (lagging, playing)
    }


@pytest.mark.parametrize("truth", [lagging, playing])
def test_memory_that_no_name_explains_raises_an_alarm_without_a_name(verdicts, truth):
    found = verdicts[truth]
    assert found.unknown, reported(found)
    assert not found.effects


@pytest.mark.parametrize("truth", [lagging, playing])
def test_a_curve_over_the_past_stands_at_its_place_and_predicts(verdicts, truth):
    """Any place after the force is correct: filtering before it equals an addition after it."""
    found = verdicts[truth]
    (error,) = found.held_out
    assert error.improved < 0.5 * error.calibrated, reported(found)
    assert found.location.injection != "sensor of place"
    assert found.location.regressor == f"{KIND[truth]} of force"

"""Accepted effects lower held-out errors, and every verdict reports a large error."""

import numpy as np
import pytest

from slipbench.identification.mismatch.reporting.memo import sentence
from tests.identification.mismatch.laws.explained import explained, large_errors, reported
from tests.identification.mismatch.laws.spring import Spring, noise_of_the_force, spring, swung

RISES = 1.02
"""Share of the re-calibrated error beyond which a held-out error has risen."""
WRONG = ("quadratic.deflection", "asymmetry.deflection", "dead_zone.deflection")


def decaying_friction(x: float, v: float, t: float) -> float:
    return x + 0.3 * np.exp(-t / 2.0) * np.sign(v)


def decaying_force(x: float, v: float, t: float) -> float:
    return x + 0.3 * np.exp(-t / 2.0)


def rubbing(x: float, v: float, t: float) -> float:
    return x + 0.05 * np.tanh(v / 0.5) * abs(x)


def ripple(x: float, v: float, t: float) -> float:
    return x + 0.05 * np.sin(20.0 * x)


def softening(x: float, v: float, t: float) -> float:
    return x * (1.0 - 0.03 * t)


UNKNOWN = [decaying_friction, decaying_force, rubbing, ripple, softening]


@pytest.fixture(scope="module")
def verdicts(tmp_path_factory):
    nominal = spring(tmp_path_factory.mktemp("spring"))
    return {f: explained(nominal, [swung(1, f)], [swung(2, f)], WRONG) for f in UNKNOWN}


@pytest.mark.parametrize("truth", UNKNOWN, ids=lambda f: f.__name__)
def test_no_held_out_error_rises_by_what_is_accepted(verdicts, truth: Spring):
    """Names and free curves that predict held-out recordings worse are rejected."""
    found = verdicts[truth]
    assert not found.effects, reported(found)
    assert all(e.improved <= RISES * e.calibrated for e in found.held_out), reported(found)


@pytest.mark.parametrize("truth", UNKNOWN, ids=lambda f: f.__name__)
def test_what_leaves_a_large_held_out_error_is_significant(verdicts, truth: Spring):
    """A gain that changes with time or with a position, a ripple: none is in the library here."""
    found = verdicts[truth]
    assert found.unknown or found.remains, reported(found)


@pytest.mark.parametrize("truth", UNKNOWN, ids=lambda f: f.__name__)
def test_no_verdict_is_silent_about_a_large_held_out_error(verdicts, truth: Spring):
    """The sentence reports each output that the simulation does not follow, and no other."""
    found = verdicts[truth]
    large = large_errors(found)
    assert ("stays large: place" in sentence(found)) == bool(large), reported(found)
    assert "agree:" not in sentence(found)


def test_what_is_missing_is_described(verdicts):
    """How a gain changes with time, and how long the waves of a ripple are (true: 0.31 m)."""
    over_time = verdicts[softening].location
    assert over_time.regressor == "scale of position along time"
    assert over_time.shape == "linear"
    assert verdicts[ripple].location.shape.startswith("a ripple, one wave in about 0.3")


@pytest.mark.parametrize("seed", [1, 11])
def test_no_large_error_is_told_where_nothing_is_missing(tmp_path, seed):
    found = explained(spring(tmp_path), [swung(seed)], [swung(seed + 1)], WRONG)
    assert not large_errors(found), reported(found)
    assert "agree: no significant mismatch" in sentence(found)


def test_repeated_trials_tell_that_a_large_error_is_physics(tmp_path):
    """They share the missing effect; their noise and disturbances are independent."""
    force = noise_of_the_force(3, 10.0)
    repeats = [swung(s, ripple, force=force) for s in (4, 5)]
    found = explained(spring(tmp_path), [swung(1, ripple)], repeats, WRONG)
    assert "physics is missing" in sentence(found), reported(found)


def test_an_effect_that_held_out_recordings_cannot_be_simulated_with_is_not_accepted(tmp_path):
    """Drag grows without bound on them: the analysis goes on and reports contradictions."""
    found = explained(spring(tmp_path), [swung(1, softening)], [swung(2, softening)])
    assert found.complete
    assert not any(e.name == "quadratic_drag" for e in found.effects), reported(found)


@pytest.mark.parametrize("pushed", [1.0, 4.0])
def test_what_one_training_recording_shows_once_is_no_physics(tmp_path, pushed):
    """A person pushes the mass for 0.6 s; held-out recordings do not contain this disturbance."""

    def bump(force: np.ndarray) -> np.ndarray:
        return force + pushed * (np.arange(force.size) // 60 == 7)

    library = ("offset", "dead_zone.force", "cubic.deflection", "quadratic.deflection")
    found = explained(spring(tmp_path), [swung(1, felt=bump)], [swung(2)], library)
    assert not found.effects, reported(found)
    assert all(e.improved <= RISES * e.calibrated for e in found.held_out), reported(found)


@pytest.mark.parametrize("seed", [1, 11, 21])
def test_where_nothing_is_missing_nothing_is_claimed(tmp_path, seed):
    rides = [swung(s, force=noise_of_the_force(s, 8.0)) for s in (seed, seed + 1)]
    found = explained(spring(tmp_path), rides[:1], rides[1:], WRONG)
    assert not found.mismatch, reported(found)
    assert not found.effects
    assert not found.unknown

"""The trial that is proposed shows what it is proposed for."""

import re

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.naming.next_trial import next_trial
from slipbench.identification.mismatch.thresholds import EXCITED
from slipbench.plant.effects.backlash import Backlash
from slipbench.plant.effects.held_frames import HeldFrames
from slipbench.plant.effects.radius_with_lean import RadiusWithLean
from tests.identification.mismatch.conditions import erring, system
from tests.identification.motorcycle_recording import Ride, ride

RIDE = Ride("sweep", 2, 1400.0, 0.03, 0.5, 9.0, seconds=4.0, seed=71)


def fit():
    model = begin(system(), [system().prepare(ride(erring(7), RIDE))], []).training
    return calibrate(model, model.origin())


def test_of_several_effects_the_one_that_a_trial_shows_most_plainly_is_named() -> None:
    """No trial of the menu leans, so none shows a radius that changes with lean."""
    told = next_trial(fit(), (), (RadiusWithLean, Backlash))
    assert told is not None
    assert "would show backlash" in told[0]
    nats = float(re.search(r"gain ([\d.]+) nats", told[0])[1])
    assert nats >= EXCITED


def test_a_trial_that_would_show_nothing_is_not_proposed() -> None:
    assert next_trial(fit(), (), (RadiusWithLean,)) is None


def test_nothing_open_needs_no_trial() -> None:
    assert next_trial(fit(), (HeldFrames,), ()) is None

"""The proposed trial excites the effect for which it is proposed."""

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
    """No candidate trial leans, so none excites a radius that changes with lean."""
    proposal = next_trial(fit(), (), (RadiusWithLean, Backlash))
    assert proposal is not None
    assert "would show backlash" in proposal[0]
    nats = float(re.search(r"gain ([\d.]+) nats", proposal[0])[1])
    assert nats >= EXCITED


def test_a_trial_that_would_show_nothing_is_not_proposed() -> None:
    assert next_trial(fit(), (), (RadiusWithLean,)) is None


def test_nothing_open_needs_no_trial() -> None:
    assert next_trial(fit(), (HeldFrames,), ()) is None

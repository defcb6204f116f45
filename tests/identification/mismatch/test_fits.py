"""Effects that calibration has compensated are identified near the nominal parameters."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.fit.calibrate import calibrate, far_from_prior
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.naming.candidates import candidates
from slipbench.identification.mismatch.naming.fits import fits_from_the_file, fitted, promising
from slipbench.identification.mismatch.naming.score import Score, screen
from slipbench.plant.effects.air_box_delay import AirBoxDelay
from slipbench.plant.effects.backlash import Backlash
from slipbench.plant.effects.channel_lag import ChannelLag
from slipbench.plant.effects.channel_latency import ChannelLatency
from slipbench.plant.effects.driveline_loss import DrivelineLoss
from slipbench.plant.effects.eccentricity import Eccentricity
from slipbench.plant.effects.gear_play import GearPlay
from slipbench.plant.effects.hardening_cush import HardeningCush
from slipbench.plant.effects.load_transfer import LoadTransfer
from slipbench.plant.effects.optical_lag import OpticalLag
from slipbench.plant.effects.radius_growth import RadiusGrowth
from slipbench.plant.effects.relaxation_length import RelaxationLength
from slipbench.plant.effects.squat import Squat
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.vehicle_file import load_vehicle
from slipbench.plant.vehicles import DEMONSTRATION
from tests.identification.mismatch.conditions import erring, system
from tests.identification.motorcycle_recording import Ride, ride

TRIALS = (
    Ride("multisine", 3, 1050.0, 0.035, 0.6, 14.0, seconds=6.0, seed=31),
    Ride("square", 2, 1150.0, 0.06, 0.9, seconds=6.0, seed=32),
)
STEADY = Ride("sweep", 2, 1204.0, 0.0217, 0.5, 12.0, seconds=6.0, seed=5)
MOVING = (
    AirBoxDelay,
    Backlash,
    DrivelineLoss,
    GearPlay,
    HardeningCush,
    LoadTransfer,
    RelaxationLength,
    Squat,
)
KINDS = (ChannelLag, ChannelLatency, DrivelineLoss, OpticalLag)
LATE = 7e-3


def told_late(recording, role: str, late: float):
    channel = recording.channels[role]
    values = np.interp(channel.time - late, channel.time, channel.value)
    return replace(recording, channels={**recording.channels, role: replace(channel, value=values)})


def loose() -> Motorcycle:
    """The demonstration motorcycle, of which only the backlash is missing."""
    true = load_vehicle(DEMONSTRATION).motorcycle
    return replace(true, effects=tuple(e for e in true.effects if isinstance(e, Backlash)))


@cache
def calibrated(seed: int, late: float) -> Fit:
    print(f"seed {seed}")
    rides = [told_late(ride(erring(seed), t), "throttle_position", late) for t in TRIALS]
    model = begin(system(), [system().prepare(r) for r in rides], []).training.coarse
    return calibrate(model, model.origin())


@pytest.mark.parametrize("seed", [1, 2])
def test_a_late_sensor_that_calibration_took_for_a_slow_actuator_is_found(seed):
    base = calibrated(seed, LATE)
    assert far_from_prior(base)
    gains = {
        s.candidate.name: s.log_likelihood_gain
        for s in screen(Linearization.of(base), KINDS).scores
    }
    best = fits_from_the_file(base, KINDS, lambda _: None)[0]
    (found,) = best.effects
    assert found.name == "channel_latency.throttle_position"
    assert found.effect().latency == pytest.approx(LATE, rel=0.1)
    assert best.score - base.score > 5.0 * gains[found.name]


@pytest.mark.parametrize("seed", [1, 2])
def test_what_calibrates_as_believed_is_not_begun_again(seed):
    base = calibrated(seed, 0.0)
    assert not far_from_prior(base)
    assert fits_from_the_file(base, KINDS, lambda _: pytest.fail("nothing is to be fitted")) == []


def test_a_backlash_that_calibration_made_up_for_is_found_from_the_numbers_of_the_file() -> None:
    """At the calibrated parameters its effect response is negligible."""
    model = begin(system(), [system().prepare(ride(loose(), STEADY))], []).training
    base = calibrate(model, model.origin()).coarse
    assert far_from_prior(base)
    gains = {
        s.candidate.name: s.log_likelihood_gain
        for s in screen(Linearization.of(base), MOVING).scores
    }
    best = fits_from_the_file(base, MOVING, lambda _: None)[0]
    (found,) = best.effects
    assert found.name == "backlash"
    assert found.effect().slack == pytest.approx(13e-3, rel=0.05)
    assert best.score - base.score > 5.0 * gains["backlash"]


GROWTH = 1e-5


@cache
def grown(seed: int) -> Fit:
    """Calibrate a motorcycle whose tyres grow."""
    print(f"seed {seed}")
    true = replace(erring(seed), effects=(RadiusGrowth(growth=GROWTH, front_growth=0.5 * GROWTH),))
    model = begin(system(), [system().prepare(ride(true, t)) for t in TRIALS], []).training.coarse
    return calibrate(model, model.origin())


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_calibration_absorbs_is_followed_along_its_bend(seed):
    base = grown(seed)
    (score,) = screen(Linearization.of(base), [RadiusGrowth]).scores
    refitted = fitted(base, score.candidate)
    assert score.kept < 0.01
    (found,) = refitted.effects
    assert found.effect().growth == pytest.approx(GROWTH, rel=0.25)


@pytest.mark.parametrize(
    ("gain", "kept", "p", "typical", "tried"),
    [
        (3.0, 0.001, 0.5, 500.0, True),
        (1.0, 0.001, 0.5, 500.0, False),
        (3.0, 0.1, 0.01, 500.0, False),
        (3.0, 0.001, 0.01, 50.0, False),
        (9.0, 0.1, 0.01, 50.0, True),
        (9.0, 0.1, 0.5, 50.0, False),
    ],
)
def test_what_scores_little_is_fitted_only_if_calibration_makes_up_for_it(
    gain, kept, p, typical, tried
):
    (kind,) = candidates(RadiusGrowth)
    score = Score(kind, 1.0, gain, 9.0, kept, p, typical)
    assert bool(promising([score])) == tried


@pytest.mark.parametrize(
    ("share", "kept", "tried"),
    [(0.1, 1.0, False), (0.1, 0.2, True), (0.5, 1.0, True), (2.0, 1.0, True)],
)
def test_a_negligible_size_is_not_fitted_where_it_is_certain(share, kept, tried):
    """All discs have a manufacturing tolerance, whose gain may be large. share: of that size."""
    eccentricity = next(candidates(Eccentricity))
    amplitude = share * eccentricity.negligible_difference / abs(eccentricity.added)
    score = Score(eccentricity, amplitude, 40.0, 900.0, kept, 0.01, 900.0)
    assert bool(promising([score], largest_p=1.0)) == tried

"""Names beside similar effects: pairs, ties, and regressors of located curves."""

from slipbench.plant.effects.acceleration_limit import AccelerationLimit
from slipbench.plant.effects.backlash import Backlash
from slipbench.plant.effects.driveline_loss import DrivelineLoss
from slipbench.plant.effects.gear_play import GearPlay
from tests.identification.mismatch.laws.explained import holds, names, reported
from tests.identification.mismatch.laws.motorcycle import ridden

LIMITS = ("rate_limit", "acceleration_limit", "voltage_limit")
SLACK = 8e-3  # rad


def test_two_effects_of_the_driveline_are_both_named():
    found = ridden(
        Backlash(slack=SLACK),
        DrivelineLoss(),
        library=("backlash", "driveline_loss", "gear_play", "hardening_cush"),
    )
    assert names(found) == ["backlash", "driveline_loss"], reported(found)
    assert holds(found, "backlash", "slack", SLACK, slack=0.03)


def test_an_acceleration_limit_is_named_or_listed_with_what_is_like_it():
    """A limit acts only where it is reached: candidates cover its magnitude in small steps."""
    found = ridden(AccelerationLimit(limit=250.0), library=LIMITS)
    indistinguishable = {n for one in found.equivalents for n in one}
    assert len(found.effects) == 1, reported(found)
    assert "acceleration_limit" in {*names(found), *indistinguishable}
    assert "rate_limit" not in {*names(found), *indistinguishable}


def test_play_of_a_gear_is_no_stiction():
    found = ridden(
        GearPlay(play=5e-3),
        library=("backlash", "gear_play", "throttle_stiction", "driveline_loss"),
    )
    assert names(found) == ["gear_play"], reported(found)


def test_along_what_a_named_effect_acts_is_said():
    found = ridden(AccelerationLimit(limit=250.0), library=LIMITS)
    assert found.location.injection == "servo force"
    assert found.location.regressor

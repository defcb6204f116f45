"""Laws of an explanation, on motorcycles with known truth."""

import json

import pytest

from slipbench.identification.mismatch.naming.interval import significance
from slipbench.identification.mismatch.naming.significance import predicted_held_out
from slipbench.identification.mismatch.reporting.verdict import as_json
from slipbench.identification.mismatch.thresholds import JOINT_TEST_P
from slipbench.plant.effects.asymmetric_filling import AsymmetricFilling
from slipbench.plant.effects.backlash import Backlash
from slipbench.plant.effects.effect import Effect
from slipbench.plant.effects.optical_lag import OpticalLag
from slipbench.plant.effects.rate_limit import RateLimit
from slipbench.plant.effects.relaxation_length import RelaxationLength
from slipbench.plant.effects.tooth_misplacement import ToothMisplacement
from tests.identification.mismatch.conditions import analysis, found

CERTAIN = 1e-5  # p below which an effect of this size must lie

SINGLE = [
    (RateLimit(limit=4.0), "limit", "throttle_servo"),
    (AsymmetricFilling(asymmetry=0.5), "asymmetry", "engine"),
    (Backlash(slack=8e-3), "slack", "driveline"),
    (RelaxationLength(length=0.2), "length", "tyre"),
    (ToothMisplacement(displacement=2e-3, tooth=5), "displacement", "encoder"),
    (OpticalLag(time_constant=30e-3), "time_constant", "optical_sensor"),
]


@pytest.mark.parametrize("seed", [1, 2])
def test_where_nothing_is_missing_nothing_is_claimed(seed: int) -> None:
    verdict = found(seed=seed)
    assert not verdict.mismatch
    assert not verdict.effects
    assert not verdict.unknown


@pytest.mark.parametrize(
    ("effect", "parameter", "block"), SINGLE, ids=[e.name for e, _, _ in SINGLE]
)
def test_a_single_effect_is_named_and_its_size_told(
    effect: Effect, parameter: str, block: str
) -> None:
    verdict = found((effect,), seed=3)
    assert [e.name for e in verdict.effects] == [effect.name]
    estimate = next(p for p in verdict.effects[0].parameters if p.name == parameter)
    true = getattr(effect, parameter)
    assert abs(estimate.value - true) < max(0.1 * true, 1.5 * (estimate.high - estimate.low))
    assert all(e.improved < 1.05 * e.nominal for e in verdict.held_out)


def test_without_its_name_an_effect_is_located_and_no_other_name_is_given() -> None:
    verdict = found((Backlash(slack=8e-3),), seed=4, without=("backlash",))
    assert verdict.unknown
    assert not verdict.effects
    assert verdict.location is not None
    assert verdict.location.block == "driveline"
    assert verdict.shape


def test_without_a_throttle_position_the_command_drives_the_motion() -> None:
    verdict = found((Backlash(slack=8e-3),), seed=5, drop=("throttle_position",))
    assert [e.name for e in verdict.effects] == ["backlash"]


def test_the_same_recordings_give_the_same_verdict() -> None:
    one, two = (as_json(found((Backlash(slack=8e-3),), seed=6)) for _ in range(2))
    assert one == two
    assert json.loads(one)["mismatch"]["found"]


def test_what_is_there_is_foretold_and_what_is_not_is_not() -> None:
    found = analysis((Backlash(slack=8e-3),), seed=5)
    fit, held_out = found.named.fit, found.held_out
    assert [c.name for c in fit.candidates] == ["backlash"]
    assert significance(fit, 0) < CERTAIN
    assert predicted_held_out(fit, 0, held_out) < 1e-5
    without = analysis(seed=5).held_out
    assert without is not None
    assert predicted_held_out(fit, 0, without) > JOINT_TEST_P

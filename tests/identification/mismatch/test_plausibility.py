"""Among indistinguishable names the plausible one leads; evidence has priority."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.naming.candidates import candidates
from slipbench.identification.mismatch.naming.plausibility import (
    PRIORS,
    doubts,
    plausible_first,
    rank,
)
from slipbench.plant.effects.library import BY_NAME
from tests.identification.mismatch.laws.spring import noise_of_the_force, spring, swung

MARGIN = 10.0


@dataclass(frozen=True)
class Scored:
    """Stand-in for a fit with the fields that are used."""

    score: float
    candidates: tuple
    model: object
    point: object = None
    noise: object = None


def fit_of(folder, **changes) -> Fit:
    system = spring(folder)
    a = begin(system, [system.prepare(swung(51, **changes))], [])
    return calibrate(a.training, a.training.origin())


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    """A spring excited from the first sample by a force held for ten samples."""
    return fit_of(tmp_path_factory.mktemp("spring"))


@pytest.fixture(scope="module")
def rested(tmp_path_factory):
    """A spring at rest for two seconds; its measured force contains noise at every sample."""
    force = noise_of_the_force(51, 10.0)
    force = force + 0.01 * np.random.default_rng(5).standard_normal(force.size)
    force[:200] *= 1e-6
    return fit_of(tmp_path_factory.mktemp("rested"), force=force)


def named(fit, key, size=1.0):
    kind = next(k for k in fit.model.system.library if k().key == key)
    return next(candidates(kind)).resized(size)


def reasons(fit, key, size=1.0):
    return [p.reason for p in doubts(named(fit, key, size), fit)]


def test_every_prior_has_a_reason_that_is_a_sentence_of_its_own():
    assert len({p.reason for p in PRIORS}) == len(PRIORS)
    assert [p.rank for p in PRIORS] == sorted((p.rank for p in PRIORS), reverse=True)


def test_a_channel_of_one_table_has_no_clock_of_its_own(bare):
    assert "all channels of this recording share one clock" in reasons(bare, "clock_offset.place")
    other = replace(
        bare.model.records[0],
        sensors={n: replace(s, clock="logger") for n, s in bare.model.records[0].sensors.items()},
    )
    apart = replace(bare, model=replace(bare.model, records=(other,)))
    assert reasons(apart, "clock_offset.place") == [PRIORS[-1].reason]


def test_no_clock_drifts_by_more_than_a_thousandth(bare):
    assert "no clock drifts by more than 1e-3" in reasons(bare, "clock_drift.place", 57.0)
    assert "no clock drifts by more than 1e-3" not in reasons(bare, "clock_drift.place", 0.5)


def test_an_offset_must_be_seen_at_rest(bare, rested):
    offset_reason = "an offset of the sensor would be seen at rest, where it reads zero"
    assert offset_reason in reasons(rested, "offset.place", 10.0)
    assert offset_reason not in reasons(bare, "offset.place", 0.1)


def test_a_computed_input_does_not_err_and_a_measured_one_may(bare, rested):
    assert reasons(bare, "offset.force") == ["a computed input does not err"]
    assert reasons(rested, "offset.force") == []


def test_physics_has_no_doubts_and_goes_before_a_sensor(bare):
    assert reasons(bare, "cubic.deflection") == []
    assert reasons(bare, "cubic.place") == [PRIORS[-1].reason]


def test_a_speed_is_lost_to_friction_and_not_by_leakage(bare):
    assert reasons(bare, "linear_loss.velocity_rate") == [
        "a speed is lost to friction, not by leakage"
    ]
    assert reasons(bare, "linear_loss.position_rate") == []
    assert reasons(bare, "viscous_friction.deflection/velocity") == []


def scored(bare, key, score):
    return Scored(score, (named(bare, key),), bare.model, bare.point, bare.noise)


def test_only_ties_change_places(bare):
    sensor, near = scored(bare, "cubic.place", 100.0), scored(bare, "cubic.deflection", 91.0)
    far = scored(bare, "cubic.deflection", 89.0)
    assert list(plausible_first([sensor, near], 0, MARGIN)) == [near, sensor]
    assert list(plausible_first([sensor, far], 0, MARGIN)) == [sensor, far]
    assert list(plausible_first([], 0, MARGIN)) == []


def test_fits_beyond_a_tie_are_taken_only_when_needed(bare):
    """Each fit that is taken was tested for significance, which takes seconds."""
    scores = (100.0, 91.0, 89.0, 88.0)
    fits = [scored(bare, "cubic.deflection", score) for score in scores]
    taken = []
    ranked = plausible_first((taken.append(f) or f for f in fits), 0, MARGIN)
    assert next(ranked) is fits[0]
    assert taken == fits[:3]
    assert list(ranked) == fits[1:]


def test_a_tie_of_equal_plausibility_stays_in_order_of_evidence(bare):
    best = scored(bare, "cubic.deflection", 100.0)
    second = scored(bare, "quadratic.deflection", 99.0)
    assert list(plausible_first([best, second], 0, MARGIN)) == [best, second]


def test_what_all_share_does_not_count(bare):
    shared = Scored(1.0, (named(bare, "cubic.place"), named(bare, "cubic.deflection")), bare.model)
    assert rank(shared, 0) == 1
    assert rank(shared, 1) == 0


def test_all_faults_of_a_sensor_weigh_alike():
    """An optical sensor lag acts in the plant's equations, an optical latency does not."""
    nowhere = SimpleNamespace(model=SimpleNamespace(records=()))

    def ranks(name: str) -> list[int]:
        return [p.rank for p in doubts(next(candidates(BY_NAME[name])), nowhere)]

    assert ranks("optical_lag") == ranks("channel_latency") == [1]
    assert ranks("relaxation_length") == []

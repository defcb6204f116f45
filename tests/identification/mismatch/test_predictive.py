"""Recordings are predicted by a fit of others within the uncertainty of its parameters."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.fit.held_out import simulated_only
from slipbench.identification.mismatch.fit.predictive import belief, predictive
from slipbench.identification.mismatch.simulation.model import models
from tests.identification.mismatch.laws.explained import explained, names, reported
from tests.identification.mismatch.laws.spring import (
    MODEL,
    cubic,
    noise_of_the_force,
    spring,
    swung,
)

STIFFENING = 'damping = { value = 0.1, unit = "1", plus_minus = 0.05 }\n'
HARDENING = MODEL.replace(
    STIFFENING, STIFFENING + 'hardening = { value = 0.05, unit = "1/m^2", plus_minus = 0.05 }\n'
).replace('value = "position"\nsize = { value = 1, unit = "m" }\nalong', "value = "
    '"position + hardening * position ** 3"\nsize = { value = 1, unit = "m" }\nalong')  # fmt: skip
CUBE, SHARE = 0.12, 0.01  # 1/m^2 and m/V
GENTLE = 0.05  # V: the spring hardens by nothing that a recording shows


def ride(seed, size, share=0.0):
    force = noise_of_the_force(seed, 8.0, size)
    return swung(seed, cubic(CUBE), force=force, sensed=lambda x: x + share * force)


@pytest.fixture(scope="module")
def system(tmp_path_factory):
    return spring(tmp_path_factory.mktemp("hardening"), HARDENING)


def fits(system, training, there):
    """A fit of some recordings, and the model of others."""
    first, other = models(
        system, [system.prepare(r) for r in training], [system.prepare(r) for r in there]
    )
    return calibrate(first, first.origin()), other


def test_what_no_recording_excited_is_believed_as_the_file_states_it(system):
    fit, _ = fits(system, [ride(1, GENTLE)], [ride(3, 1.0)])
    precision = belief(fit, 0).precision
    i = [k.name for k in fit.model.known].index("hardening")
    assert 1.0 <= precision[i, i] < 2.0  # of its prior alone it would be 1
    others = np.delete(np.diag(precision), i)
    assert np.all(others > 10.0)


def test_a_prediction_is_no_worse_than_with_fixed_parameters_and_no_better_than_a_refit(system):
    fit, other = fits(system, [ride(1, GENTLE)], [ride(3, 1.0)])
    fixed = simulated_only(other, fit.model.at(fit.point), fit)
    free = calibrate(other, other.origin())
    inside = predictive(fit, fixed, other)
    assert fixed.score < inside - 100.0  # the hardening was not known
    assert inside < free.score + 1.0


def test_certain_parameters_are_as_good_as_fixed_ones(system):
    fit, other = fits(system, [ride(1, 1.0), ride(2, 1.0)], [ride(3, 0.3)])
    fixed = simulated_only(other, fit.model.at(fit.point), fit)
    gain = predictive(fit, fixed, other) - fixed.score
    assert 0.0 <= gain < 5.0


def test_a_belief_is_the_posterior_of_its_own_recordings(system):
    """At the fit itself nothing is gained by a move."""
    fit, _ = fits(system, [ride(1, 1.0)], [])
    known = belief(fit, sum(q.size for q in fit.point.q))
    assert known.mean[: len(fit.point.x)] == pytest.approx(fit.point.x)
    moved = replace(fit, point=replace(fit.point, x=fit.point.x + 0.1))
    assert known.score(moved) < known.score(fit)


def test_a_parameter_that_only_the_held_out_recordings_excite_withdraws_no_name(system):
    """Regression: the right name was withdrawn, with 0.4 of a pedal in the reading of a wheel."""
    training = [ride(seed, GENTLE, SHARE) for seed in (1, 2)]
    held_out = [ride(3, 1.0, SHARE)]
    library = ("leak_from_channel.place/force", "dead_zone.deflection")
    found = explained(system, training, held_out, library)
    assert names(found) == ["leak_from_channel.place/force"], reported(found)


def test_the_fixed_parameters_would_withdraw_it(system):
    """The law above tests nothing where they would not."""
    training = [system.prepare(ride(seed, GENTLE, SHARE)) for seed in (1, 2)]
    a = begin(system, training, [system.prepare(ride(3, 1.0, SHARE))])
    kinds = [k for k in system.library if k().key == "leak_from_channel.place/force"]
    analyse(a, kinds, until=3)
    base, fit = a.named.base, a.named.fit
    assert fit.candidates
    fixed = [simulated_only(a.held_out, f.model.at(f.point), fit).score for f in (base, fit)]
    assert fixed[1] < fixed[0] - 12.0

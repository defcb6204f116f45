"""Laws of the expected evidence of a trial."""

from dataclasses import replace

import pytest

from slipbench.identification.experiments.evidence import expected_evidence, rehearsed
from slipbench.identification.experiments.hypothesis import Hypothesis, hypotheses_of
from slipbench.identification.mismatch.motorcycle.menu import Choice
from slipbench.protocol.errors import InputError
from tests.identification.experiments.problems import recorded
from tests.identification.mismatch.conditions import system

SQUARE = Choice(2, 1200.0, "throttle", "square", 0.03, 0.8, seconds=6.0)
QUIET = replace(SQUARE, amplitude=1e-5)


def asked(*names: str):
    return (hypotheses_of(names, system().library, "test"),)


def nats(choice, *names, known=None):
    (found,) = expected_evidence(
        rehearsed(known or recorded(), choice), asked(*names)
    ).nats.values()
    return found


def test_a_hypothesis_is_not_told_from_itself():
    (first, second) = asked("backlash", "hardening_cush")[0]
    exact = Hypothesis(first.candidate)
    judge = rehearsed(recorded(), SQUARE)
    (own,) = expected_evidence(judge, ((exact, exact),)).nats.values()
    (other,) = expected_evidence(judge, ((exact, Hypothesis(second.candidate)),)).nats.values()
    assert 0.0 <= own < 1e-3 * other


def test_the_order_of_the_hypotheses_does_not_matter():
    there = nats(SQUARE, "backlash", "hardening_cush")
    back = nats(SQUARE, "hardening_cush", "backlash")
    assert there == pytest.approx(back, rel=1e-9)


@pytest.mark.parametrize("names", [("backlash", "hardening_cush"), ("nothing", "backlash")])
def test_twice_the_noise_leaves_at_least_a_quarter_and_less_than_all_of_the_evidence(names):
    """Without priors a quarter is left; priors hold more of the vehicle the louder the noise is."""
    known = recorded()
    louder = replace(known, noise=[replace(w, inverse=0.5 * w.inverse) for w in known.noise])
    quiet, loud = nats(SQUARE, *names), nats(SQUARE, *names, known=louder)
    assert 0.25 * quiet * (1 - 1e-6) <= loud < quiet


def test_what_is_known_of_the_vehicle_adds_evidence():
    """A vehicle of which every number is known ten times better leaves less to imitate an effect."""
    known = recorded()
    exact = [replace(c, scale=0.1 * c.scale) for c in known.model.known]
    sure = replace(known, model=replace(known.model, known=exact))
    assert nats(SQUARE, "nothing", "backlash", known=sure) >= nats(SQUARE, "nothing", "backlash")


def test_a_trial_without_excitation_tells_less():
    assert nats(QUIET, "nothing", "asymmetric_filling") < 0.1 * nats(
        SQUARE, "nothing", "asymmetric_filling"
    )


def test_a_motorcycle_that_cannot_hold_the_point_raises():
    with pytest.raises(ValueError, match="holds"):
        rehearsed(recorded(), replace(SQUARE, engine_speed=9000.0))


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (("backlash", "backlashh"), "did you mean 'backlash'"),
        (("backlash", "backlash"), "two or more hypotheses"),
        ((), "two or more hypotheses"),
    ],
)
def test_a_wrong_name_is_refused_with_the_nearest(names, words):
    with pytest.raises(InputError, match=words):
        hypotheses_of(names, system().library, "--between")

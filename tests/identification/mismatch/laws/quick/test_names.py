"""Permitted names: the right formula or one of its class; none if the library lacks it."""

import numpy as np
import pytest

from slipbench.identification.mismatch.reporting.memo import sentence
from tests.identification.mismatch.laws.explained import explained, holds, names, reported
from tests.identification.mismatch.laws.spring import (
    FREQUENCY,
    cubic,
    noise_of_the_force,
    spring,
    swung,
)

BENT = tuple(
    f"{name}.deflection" for name in ("cubic", "quadratic", "asymmetry", "dead_zone", "saturation")
)
CUBE = 0.15  # 1/m^2


@pytest.fixture
def nominal(tmp_path):
    return spring(tmp_path)


def two(deflection, **changes):
    """A training and a held-out recording of one truth."""
    return [swung(1, deflection, **changes)], [swung(2, deflection, **changes)]


def test_what_is_missing_is_named_with_its_size_beside_all_that_is_like_it(nominal):
    found = explained(nominal, *two(cubic(CUBE)), BENT)
    assert names(found) == ["cubic.deflection"], reported(found)
    assert holds(found, "cubic", "cube", CUBE, slack=0.02)


def test_without_its_name_it_is_located_and_no_other_name_is_given(nominal):
    """An asymmetry in the place of a cube explains much and leaves a multiple of the floor."""
    found = explained(nominal, *two(cubic(CUBE)), ("quadratic.deflection", "asymmetry.deflection"))
    assert found.unknown, reported(found)
    assert not found.effects
    assert found.location.injection in ("velocity rate", "deflection")
    assert found.location.regressor == "deflection"


def test_what_held_out_recordings_contradict_is_an_alarm_without_a_name(nominal):
    """The spring hardens in the training recording and softens in the other."""
    training, held_out = [swung(1, cubic(CUBE))], [swung(2, cubic(-0.03))]
    found = explained(nominal, training, held_out, BENT)
    assert found.mismatch, reported(found)
    assert found.unknown
    assert not found.effects
    assert "cubic.deflection" in [v.name for v in found.vetoes]
    assert "contradict" in sentence(found)
    assert "cubic.deflection" in sentence(found)


def test_a_formula_that_is_not_exact_takes_no_second_name_at_its_place(nominal):
    """The truth is a sinh; the residual of its cubic fit does not justify a dead zone beside it."""
    found = explained(nominal, *two(lambda x, v, t: np.sinh(0.9 * x) / 0.9), BENT)
    assert names(found) == ["cubic.deflection"], reported(found)


@pytest.mark.parametrize("rest", [1e-3, 5e-3])
def test_names_of_precise_recordings_stand_beside_a_tiny_remainder(nominal, rest):
    """In nats the remainder is worth hundreds, as a share of the error far below 1 %."""
    truth = two(lambda x, v, t: x + CUBE * x**3 + rest * np.tanh(v / 0.3), noise=1e-4)
    found = explained(nominal, *truth, BENT)
    assert names(found) == ["cubic.deflection"], reported(found)
    assert not found.unknown
    assert found.remains is None or found.remains.share < 0.01


@pytest.mark.parametrize("rest", [0.02, 0.12])
def test_a_right_name_is_not_withdrawn_for_a_curve_that_predicts_no_more(nominal, rest):
    """Friction outside the library has a thousandth and a twelfth of the gain of the cube."""
    truth = two(lambda x, v, t: x + CUBE * x**3 + rest * np.tanh(v / 0.3))
    found = explained(nominal, *truth, BENT)
    assert "cubic.deflection" in names(found), reported(found)
    assert not found.unknown
    assert found.remains is not None


@pytest.mark.xfail(
    reason="asymmetry and cubic are named, held-out error 0.017 m beside a floor of 0.003",
    strict=False,
)
def test_two_effects_of_one_place_are_both_named_though_one_like_them_helps_more_alone(nominal):
    """A third effect imitates a part of both; the search must leave it again."""
    found = explained(nominal, *two(lambda x, v, t: x + CUBE * x**3 + 0.1 * x**2), BENT)
    assert names(found) == ["cubic.deflection", "quadratic.deflection"], reported(found)


def test_an_effect_that_few_segments_of_training_show_is_named(nominal):
    """Held-out recordings excite it often; together with training data the evidence suffices."""

    def gentle_with_bursts(seed, at):
        force = noise_of_the_force(seed, 10.0, 0.3)
        for begin in at:
            force[100 * begin : 100 * begin + 80] *= 5.0
        return swung(seed, cubic(CUBE), force=force)

    rides = [gentle_with_bursts(1, (4,))], [gentle_with_bursts(2, (1, 3, 5, 7, 9))]
    found = explained(nominal, *rides, BENT)
    assert names(found) == ["cubic.deflection"], reported(found)


def test_what_the_excitation_never_reached_is_reported_as_not_excited(nominal):
    force = 0.02
    rides = [swung(s, cubic(CUBE), force=noise_of_the_force(s, 10.0, force)) for s in (1, 2)]
    found = explained(nominal, rides[:1], rides[1:], BENT)
    assert not found.mismatch, reported(found)
    assert {"cubic.deflection", "saturation.deflection"} <= set(found.not_excited)


RUBBING = ("friction", "presliding", "viscous_friction", "dead_zone.force", "cubic.deflection")


def test_friction_is_named_at_the_rate_of_a_speed_without_a_seam(nominal):
    """The force opposes the motion: 0.02 m of the spring's deflection are 2.1 m/s^2."""
    force = 0.02 * FREQUENCY**2
    found = explained(nominal, *two(lambda x, v, t: x + 0.02 * np.tanh(v / 0.01)), RUBBING)
    assert names(found) == ["friction.velocity_rate/velocity"], reported(found)
    assert holds(found, "friction", "force", force, slack=0.05)


def test_an_effect_far_below_its_typical_size_is_named_where_recordings_show_it(nominal):
    """At 13 times its size the signature of a cube of 0.015 scored 0.02 nats; it brings 400."""
    found = explained(nominal, *two(cubic(0.015)), BENT)
    assert names(found) == ["cubic.deflection"], reported(found)
    assert holds(found, "cubic", "cube", 0.015, slack=0.05)

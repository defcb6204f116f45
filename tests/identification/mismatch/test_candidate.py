"""Candidates of effects before any fit."""

import math
from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.mismatch.fit.sizing import sized, sizes
from slipbench.identification.mismatch.naming.candidates import (
    candidates,
    half_turn_shifted,
    place_in_record,
)
from slipbench.plant.effects.backlash import Backlash
from slipbench.plant.effects.chain_polygon import ChainPolygon
from slipbench.plant.effects.compression_torque import CompressionTorque
from slipbench.plant.effects.eccentricity import Eccentricity
from slipbench.plant.effects.firing_torque import FiringTorque
from slipbench.plant.effects.library import LIBRARY
from slipbench.plant.effects.tooth_misplacement import ToothMisplacement
from slipbench.plant.effects.torque_dip import TorqueDip
from slipbench.plant.effects.wind import Wind

TEETH = 16
DISCS = {"rear_encoder": TEETH, "front_encoder": 48}


GO_ROUND = (Eccentricity, ChainPolygon, CompressionTorque, FiringTorque)


@pytest.mark.parametrize("kind", GO_ROUND)
@pytest.mark.parametrize("phase", np.linspace(-math.pi, math.pi, 25))
def test_whatever_its_phase_a_line_shows_at_the_first_tries(kind, phase):
    # Either sign of a first candidate leads to the other sizes and angles; a line in quadrature to
    # all of them has a sign of noise.
    firsts = like_the_first(kind)
    assert max(abs(math.cos(c.effect().phase - phase)) for c in firsts) > math.sqrt(0.5) - 1e-9


@pytest.mark.parametrize("kind", GO_ROUND)
@pytest.mark.parametrize("phase", np.linspace(-math.pi, math.pi, 25))
def test_whatever_its_phase_a_line_is_tried_well_within_a_quarter_turn(kind, phase):
    evaluated = [t for c in like_the_first(kind) for t in (c, *half_turn_shifted(c))]
    assert max(math.cos(c.effect().phase - phase) for c in evaluated) > math.cos(math.radians(55))


def like_the_first(kind):
    """Return the first candidates on one subject, with one set of integers."""
    every = list(candidates(kind, DISCS))
    return [c for c in every if (c.pattern, c.integers) == (every[0].pattern, every[0].integers)]


@pytest.mark.parametrize("centre", np.linspace(400.0, 1800.0, 29))
def test_a_dip_anywhere_in_the_range_of_engines_is_tried_within_its_own_width(centre):
    evaluated = [c.effect() for c in candidates(TorqueDip)]
    assert min(abs(dip.centre - centre) for dip in evaluated) < TorqueDip().width
    assert all(place_in_record(dip) is None for dip in evaluated)


@pytest.mark.parametrize("period", np.geomspace(3.0, 20.0, 25))
def test_gusts_of_any_period_are_tried_within_a_tenth_of_a_cycle_over_a_recording(period):
    recording = 16.0  # s
    evaluated = [c.effect().gust_period for c in candidates(Wind)]
    assert min(abs(1.0 / p - 1.0 / period) for p in evaluated) * recording < 0.101


def test_what_has_no_angle_is_not_turned():
    assert not list(half_turn_shifted(next(candidates(Backlash))))


def test_no_two_orders_that_are_tried_look_alike_at_the_teeth():
    assert candidate_values(Eccentricity, "order") == {
        wheel: set(range(1, (teeth + 1) // 2)) for wheel, teeth in DISCS.items()
    }
    one, alias = (
        replace(Eccentricity(), run_out=n * 1e-3, order=n, phase=p).tooth_offsets(TEETH)
        for n, p in ((3, 0.4), (TEETH - 3, -0.4))
    )
    assert one == pytest.approx(alias)


def test_every_tooth_of_every_disc_is_tried():
    assert candidate_values(ToothMisplacement, "tooth") == {
        wheel: set(range(teeth)) for wheel, teeth in DISCS.items()
    }


@pytest.mark.parametrize("kind", LIBRARY, ids=lambda kind: kind.name)
def test_every_effect_is_tried_whether_or_not_its_disc_was_recorded(kind):
    assert next(candidates(kind)).effect()


@pytest.mark.parametrize("kind", LIBRARY, ids=lambda kind: kind.name)
@pytest.mark.parametrize("far", [-1e6, -1.0, 0.0, 1.0, 1e6])
def test_a_step_by_which_sensitivity_is_taken_is_done_in_full_even_where_a_range_ends(kind, far):
    """A shortened or zero step would understate the sensitivity to the parameter."""
    first = next(candidates(kind, DISCS))
    there = first.moved(far * np.ones(len(first.parameters)))
    for parameter, difference_step in enumerate(there.difference_steps):
        step = difference_step * np.eye(len(there.parameters))[parameter]
        stepped = there.moved(step)
        assert np.subtract(stepped.parameters, there.parameters) == pytest.approx(
            step, rel=1e-2, abs=1e-12
        )
        assert stepped.effect() != there.effect()


@pytest.mark.parametrize("kind", LIBRARY, ids=lambda kind: kind.name)
def test_a_size_stays_where_its_parameters_mean_something(kind):
    first = next(candidates(kind, DISCS))
    for far in (first.moved(1e6 * np.ones(len(first.parameters))), first.resized(1e6)):
        for p in sizes(kind):
            at = sized(p, far.size)
            assert p.low - 1e-9 * abs(p.low) <= at <= p.high + 1e-9 * abs(p.high)


def candidate_values(kind, parameter):
    """Candidate values of an integer parameter by disc."""
    found = {}
    for effect in (c.effect() for c in candidates(kind, DISCS)):
        found.setdefault(effect.subject, set()).add(getattr(effect, parameter))
    return found


@pytest.mark.parametrize("kind", LIBRARY, ids=lambda kind: kind.name)
def test_what_no_recording_tells_beside_the_size_is_as_it_was(kind):
    """Only the ratio of a tooth's displacement and radius acts: the radius is not fitted."""
    for first in list(candidates(kind, DISCS))[:1]:
        turned = first.moved(np.ones(len(first.parameters))).effect()
        for p in kind.parameters():
            if p.given:
                assert getattr(turned, p.name) == getattr(first.pattern, p.name)
    assert [p.name for p in ToothMisplacement.parameters() if p.given] == ["pitch_radius"]

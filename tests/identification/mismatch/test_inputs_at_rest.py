"""Any recording with motion is analysed: a free response, a short one, a place without effect."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.fit_external import spline_in
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.reporting.conclude import verdict
from tests.identification.mismatch.spring import recorded, system


@pytest.fixture(scope="module")
def spring(tmp_path_factory):
    return system(tmp_path_factory.mktemp("spring"))


@pytest.mark.parametrize(("cube", "named"), [(0.15, ["cubic"]), (0.0, [])])
def test_a_release_from_rest_shows_a_hardening_spring_and_nothing_where_it_is_linear(
    spring, cube, named
):
    releases = ((21, 0.9), (22, 1.2))
    runs = [
        spring.prepare(recorded(seed, cube=cube, seconds=10.0, released=at))
        for seed, at in releases
    ]
    names = ("cubic", "saturation", "quadratic")
    library = [k for k in spring.library if k.name in names and k.place.name == "deflection"]
    found = verdict(analyse(begin(spring, runs[:1], runs[1:]), library))
    assert found.mismatch == bool(named)
    assert [e.name for e in found.effects] == named


def test_a_curve_at_a_place_that_moves_no_output_is_not_fitted(spring):
    a = begin(spring, [spring.prepare(recorded(23, seconds=4.0))], [])
    base = calibrate(a.training, a.training.origin())
    knots = np.linspace(-0.4, 0.4, 5)
    unused = Curve("tilt", "tilt", "rad", "tilt", knots, 0.1 * knots, 20.0, 0.0, 0.01)
    assert spline_in(base, unused) is None
    used = spline_in(base, replace(unused, place="deflection", block="deflection", unit="m"))
    assert used is None or used.score > base.score


@pytest.mark.parametrize(("training", "held_out"), [(0.4, 0.4), (0.7, 1.1), (3.0, 0.5)])
def test_a_recording_shorter_than_the_memory_of_a_disturbance_is_analysed(
    spring, training, held_out
):
    """The model file has a segment length of 1 s."""
    runs = [
        spring.prepare(recorded(seed, cube=0.3, seconds=seconds))
        for seed, seconds in ((1, training), (2, held_out))
    ]
    library = [k for k in spring.library if k.name == "cubic" and k.place.name == "deflection"]
    assert analyse(begin(spring, runs[:1], runs[1:]), library).complete

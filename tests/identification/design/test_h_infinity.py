"""H-infinity: what SLICOT finds stays what it is on its way into the controller file.

`pip install 'slipbench[robust]'` brings slycot, which most of these need.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slipbench.controllers.limits import Range
from slipbench.controllers.linear import in_series
from slipbench.controllers.slip_controller import from_tree
from slipbench.identification.design import controller_design, h_infinity, mixed_sensitivity
from slipbench.identification.design.controller_design import Specification
from slipbench.identification.design.h_infinity import INSTALL
from slipbench.identification.design.mixed_sensitivity import (
    WeightParameters,
    available,
    reduced,
    synthesis,
)
from slipbench.identification.design.problem import Requirements
from slipbench.identification.design.steps import step_response
from slipbench.identification.design.widest import Designed, NoDesign, allowed
from slipbench.identification.models.uncertainty_set import UncertaintySet, Weight
from slipbench.protocol.errors import InputError
from tests.identification.design.test_loop_design import FREE, PATH, PERIOD, problem, simulated

needs_slycot = pytest.mark.skipif(not available(), reason=f"no slycot: {INSTALL}")
WEIGHTS = WeightParameters(1.5, 2.0, 1.0, 20.0)
F = np.geomspace(0.1, 40.0, 200)


@cache
def designed() -> Designed:
    """Search less than a design does: what is promised must hold for whatever was found."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(h_infinity, "SHAPES", ((2.0, 1.0, 5.0), (2.0, 1.0, 20.0)))
        patch.setattr(h_infinity, "CORNERS", np.geomspace(0.8, 4.0, 8))
        found = h_infinity.h_infinity(problem())
    assert isinstance(found, Designed)
    return found


def hankel(system) -> np.ndarray:
    """Hankel singular values, the greatest first: square roots of both Gramians, in modal states.

    In modal states the Gramians have a closed form, and a diagonal scaling makes them alike. The
    eigenvalues of their product lose the small values where SLICOT puts a pole far out (2e10 rad/s
    on some processors).
    """
    poles, modes = np.linalg.eig(system.A)
    b, c = np.linalg.solve(modes, system.B), system.C @ modes
    reached = -(b @ b.conj().T) / (poles[:, None] + poles.conj())
    seen = -(c.conj().T @ c) / (poles.conj()[:, None] + poles)
    scale = (np.abs(np.diag(reached)) / np.abs(np.diag(seen))) ** 0.25
    roots = []
    for gramian in (reached / np.outer(scale, scale), seen * np.outer(scale, scale)):
        values, vectors = np.linalg.eigh(gramian)
        roots.append(vectors * np.sqrt(np.maximum(values, 0.0)))
    return np.linalg.svd(roots[1].conj().T @ roots[0], compute_uv=False)


@needs_slycot
def test_taking_the_integrator_out_and_sampling_changes_nothing_that_a_loop_sees(monkeypatch):
    """At the highest order, within the band: what is reduced later starts from what SLICOT found.

    The integrator's pole was not quite 0 before, and sampling moves a sharp pair of poles a little.
    """
    monkeypatch.setattr(mixed_sensitivity, "FORGETS", 0.0)  # of any controller, slow ones too
    full = synthesis(problem(), WEIGHTS)
    ours = reduced(full, full.nstates - 1, WEIGHTS.corner, PERIOD)
    exact = full(2j * np.pi * F)
    np.testing.assert_allclose(ours.response(F), exact, rtol=0.04)


@needs_slycot
@pytest.mark.parametrize("order", [4, 6, 8])
def test_a_lower_order_is_as_near_as_balancing_promises(order, monkeypatch):
    """No further than twice the sum of the Hankel singular values left out (Glover 1984)."""
    monkeypatch.setattr(mixed_sensitivity, "FORGETS", 0.0)
    full = synthesis(problem(), WEIGHTS)
    slow = mixed_sensitivity.AT_REST * 2 * np.pi * WEIGHTS.corner
    _, rest = mixed_sensitivity._separated(full, slow)
    left_out = 2 * np.sum(hankel(rest)[order - 1 :])
    s = 2j * np.pi * F
    small = reduced(full, order, WEIGHTS.corner, PERIOD)
    whole = small.response(F) - small.integral * PERIOD / (np.exp(s * PERIOD) - 1)
    sampled = reduced(full, full.nstates - 1, WEIGHTS.corner, PERIOD)
    exact = sampled.response(F) - sampled.integral * PERIOD / (np.exp(s * PERIOD) - 1)
    rounding = 1e-5 * np.max(np.abs(exact))  # beside a pole that SLICOT put at 3e8 rad/s
    assert np.max(np.abs(whole - exact)) <= 1.05 * left_out + rounding


@needs_slycot
def test_a_design_keeps_the_reserves_and_every_condition_on_what_will_run():
    found = designed()
    m, required = found.margins["nominal"], problem().required
    assert allowed(problem(), found.controller)
    assert m.gain >= required.gain
    assert m.phase >= required.phase
    assert m.sensitivity <= required.sensitivity
    assert found.controller.order <= 11  # of path, delay and weights together


@needs_slycot
def test_what_is_promised_in_frequency_comes_in_time():
    found, time = designed(), np.arange(0, 1.0, PERIOD)
    passed = in_series((found.prefilter.section,))
    predicted = step_response(problem(), found.controller, time, found.prefilter.response)[
        "nominal"
    ]
    lived = simulated(found.controller.controller(FREE), 1.0, passed=passed)
    assert np.max(np.abs(predicted - lived)) < 0.01


@needs_slycot
def test_a_set_that_the_loop_could_not_survive_slows_it_down():
    """|W T| < 1 is a condition: where the motorcycle may be anything, the loop must be slow."""
    f = np.geomspace(0.5, 12.0, 200)
    corner = 2 * np.pi * 2.0
    weight = Weight(0.2, np.array([[corner, 1.0, 5 * corner, 1.0]]))  # 0.2 to 5
    bound = np.abs(weight.response(f))
    around = UncertaintySet(PATH, weight, f, bound, {})
    wide = replace(problem(), around=around)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(h_infinity, "SHAPES", ((2.0, 1.0, 20.0),))
        patch.setattr(h_infinity, "CORNERS", np.geomspace(0.2, 4.0, 10))
        found = h_infinity.h_infinity(wide)
    assert isinstance(found, Designed)
    assert found.robust < 1.0
    assert found.margins["nominal"].rejection < designed().margins["nominal"].rejection


@needs_slycot
def test_the_file_gives_the_controller_back():
    law = designed().controller.controller(Range(-0.05, 0.05, 5.0))
    found = designed().controller
    tree = {
        "actuator": "throttle",
        "period": PERIOD,
        "limits": {"low": -0.05, "high": 0.05, "rate": 5.0},
        "law": {
            "kind": "linear",
            "integral": found.integral,
            "shaping": found.shaping,
            "tracking_time": found.tracking_time,
        },
    }
    again = from_tree(tree).law
    np.testing.assert_array_equal(again.shaping.A, law.shaping.A)
    assert (again.integral, again.tracking_time) == (law.integral, law.tracking_time)


def test_without_slycot_it_says_what_to_install(monkeypatch):
    monkeypatch.setattr(h_infinity, "available", lambda: False)
    for module in (mixed_sensitivity, controller_design):
        monkeypatch.setattr(module, "available", lambda: False)
    found = h_infinity.h_infinity(problem())
    assert isinstance(found, NoDesign)
    assert INSTALL in found.reason
    with pytest.raises(InputError, match=r"slipbench\[robust\]"):
        Specification("throttle", Requirements(), law="h_infinity").check()


@pytest.mark.parametrize(
    ("actuator", "law", "schedule"),
    [("mixed", "pid", False), ("mixed", "h_infinity", False), ("spark", "internal_model", True)],
)
def test_what_does_not_go_together_is_refused(actuator, law, schedule):
    with pytest.raises(InputError, match=law):
        Specification(actuator, Requirements(), law=law, scheduled=schedule).check()

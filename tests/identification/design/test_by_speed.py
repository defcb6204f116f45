"""Controllers by speed: each keeps its reserves at its speed, and so do those between two.

The search for a PID is replaced by a rule of thumb, gains in proportion to 1 / gain: what is
tried here is what lies between two designs, not the designs.
"""

import numpy as np
import pytest

from slipbench.identification.design import by_speed
from slipbench.identification.design.by_speed import Scheduled, scheduled
from slipbench.identification.design.gains import Gains
from slipbench.identification.design.problem import Problem
from slipbench.identification.design.widest import Designed, NoDesign
from slipbench.identification.models.rational_model import RationalModel


def problem(gain: float) -> Problem:
    """A lag of 1 / 30 s behind 15 ms."""
    model = RationalModel(
        "throttle_command",
        "slip",
        np.zeros(0, complex),
        np.array([-30.0, -90.0]),
        gain * 2700.0,
        0.01,
    )
    return Problem(model, None, 0.005, 0.001, 1e-5, 0.05, sample_interval=0.005)


@pytest.fixture(autouse=True)
def rule_of_thumb(monkeypatch):
    def pid(problem, _most):
        steady = problem.model.response(np.zeros(1))[0].real
        gains = Gains(0.5 / steady, 12.0 / steady, 0.0, 0.005, problem.period)
        assert problem.met(gains.response)
        return Designed(gains, None, problem.loops(gains.response), 0.0, 0.0, 5.0)

    monkeypatch.setattr(by_speed, "pid", pid)


def test_each_speed_has_its_design_and_halfway_the_reserves_are_kept():
    problems = [(50.0, problem(0.16)), (30.0, problem(0.2))]
    found = scheduled(problems)
    assert isinstance(found, Scheduled)
    assert [speed for speed, _ in found.designs] == [30.0, 50.0]
    slow, fast = (design.controller for _, design in found.designs)
    halfway = by_speed.halfway(slow, fast)
    assert slow.integral < halfway.integral < fast.integral
    assert all(p.met(halfway.response) for _, p in problems)


def test_speeds_that_are_too_unlike_need_a_run_between_them():
    found = scheduled([(20.0, problem(1.0)), (60.0, problem(0.1))])
    assert isinstance(found, NoDesign)
    assert "record a run between them" in found.reason


def test_two_runs_of_one_speed_are_refused():
    found = scheduled([(50.0, problem(0.16)), (50.4, problem(0.17))])
    assert isinstance(found, NoDesign)
    assert "one run per speed" in found.reason

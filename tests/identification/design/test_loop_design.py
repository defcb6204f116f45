"""A designed loop keeps its word: margins as in the textbook, steps as the frequencies say."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slipbench.controllers.limits import Range
from slipbench.controllers.linear import in_series
from slipbench.controllers.slip_controller import from_tree
from slipbench.identification.design import widest
from slipbench.identification.design.gains import Gains
from slipbench.identification.design.loop import encircled, margins
from slipbench.identification.design.mixed import later
from slipbench.identification.design.prefilter import OVERSHOOT
from slipbench.identification.design.problem import Problem, Requirements
from slipbench.identification.design.sampled import sampled, sections, sections_response
from slipbench.identification.design.shaping import shaped
from slipbench.identification.design.steps import step_response
from slipbench.identification.design.widest import SIMILAR, Designed, better, internal_model
from slipbench.identification.models.rational_model import RationalModel

PERIOD = 0.001
FREE = Range(-100.0, 100.0)
UNCHANGED = in_series(())
PATH = RationalModel(
    "throttle_command",
    "slip",
    np.zeros(0, complex),
    np.array([-17 + 51j, -17 - 51j, -32 + 73j, -32 - 73j, -90.0]),
    2.8e8,
    0.014,
)
"""Servo, filling and driveline of a motorcycle like the demonstration one."""


def pid(problem):
    """Search less than a design does: what is promised must hold for whatever was found."""
    return widest.pid(problem, most=20)


@cache
def designed(design):
    return design(problem())


def problem(model: RationalModel = PATH) -> Problem:
    return Problem(model, None, 0.003, PERIOD, 2e-4, 0.05)


def simulated(law, seconds, model=PATH, extra=0.003, passed=UNCHANGED):
    """Slip after a step of the target, the law and the exact model in lockstep."""
    plant = sampled(model, extra, PERIOD)
    linear = in_series(sections(plant.zeros, plant.poles, plant.gain))
    x, line, y = np.zeros(linear.B.size), [0.0] * plant.delay, 0.0
    state, p = law.start(0.0, 0.0, 0.0), np.zeros(passed.B.size)
    found = []
    for _ in range(round(seconds / PERIOD)):
        found.append(y)
        wanted, p = float(passed.C @ p) + passed.D, passed.A @ p + passed.B
        command, state = law.update(state, wanted, y, PERIOD)
        line.append(command)
        x = linear.A @ x + linear.B * line.pop(0)
        y = float(linear.C @ x)
    return np.array(found)


def test_margins_of_an_integrator_behind_a_delay_are_the_textbooks():
    """L = k e^(-s d) / s: gain margin pi / (2 k d), phase margin pi / 2 - k d."""
    f, k, d = np.geomspace(1e-3, 50, 20000), 10.0, 0.05
    s = 2j * np.pi * f
    found = margins(f, k / s * np.exp(-s * d))
    assert found.gain == pytest.approx(np.pi / (2 * k * d), rel=1e-3)
    assert found.phase == pytest.approx(np.pi / 2 - k * d, rel=1e-3)
    assert found.crossover == pytest.approx(k / (2 * np.pi), rel=1e-3)
    assert found.delay == pytest.approx(found.phase / k, rel=1e-3)


@pytest.mark.parametrize("gain", [0.5, 0.9, 1.1, 3.0])
def test_the_loop_runs_round_the_point_where_it_is_unstable(gain):
    """k e^(-s d) / s is stable for k d < pi / 2."""
    f, d = np.geomspace(1e-3, 200, 60000), 0.05
    k = gain * np.pi / 2 / d
    s = 2j * np.pi * f
    loop = k / s * np.exp(-s * d) / (1 + s / 300)
    assert (encircled(loop) == 0) == (k * (d + 1 / 300) < np.pi / 2)


def test_a_sampled_model_answers_like_the_model():
    f = np.array([0.5, 2.0, 5.0, 9.0])
    exact = problem().path(f)
    np.testing.assert_allclose(sampled(PATH, 0.003, PERIOD).response(f), exact, rtol=1e-3)


@pytest.mark.parametrize("design", [internal_model, pid])
def test_what_is_promised_in_frequency_comes_in_time(design):
    found = designed(design)
    assert isinstance(found, Designed)
    time = np.arange(0, 1.0, PERIOD)
    passed = in_series((found.prefilter.section,))
    told = step_response(problem(), found.controller, time, found.prefilter.response)["nominal"]
    lived = simulated(found.controller.controller(FREE), 1.0, passed=passed)
    assert np.max(np.abs(told - lived)) < 0.01
    assert 1.0 < lived.max() < 1.0 + OVERSHOOT + 0.01


@pytest.mark.parametrize("design", [internal_model, pid])
def test_a_design_keeps_the_reserves_that_were_asked_for(design):
    required = Requirements(gain=2.0, phase=np.radians(40), sensitivity=2.0)
    found = designed(design)
    m = found.margins["nominal"]
    assert m.gain >= required.gain
    assert m.phase >= required.phase
    assert m.sensitivity <= required.sensitivity
    assert found.bandwidth > (7.0 if design is internal_model else 3.0)
    for factor in (0.85 * m.gain, 1.15 * m.gain):
        scaled = RationalModel(
            PATH.input, PATH.output, PATH.zeros, PATH.poles, PATH.gain * factor, PATH.delay
        )
        y = simulated(found.controller.controller(FREE), 3.0, scaled)
        calm = np.max(np.abs(y[-500:] - 1.0)) < np.max(np.abs(y[500:1000] - 1.0)) + 1e-6
        assert calm == (factor < m.gain)


def test_a_path_with_more_delay_gets_a_slower_loop():
    late = replace(PATH, delay=0.044)
    quick, slow = designed(pid), pid(problem(late))
    assert slow.margins["nominal"].rejection < quick.margins["nominal"].rejection


def test_an_unstable_model_gets_no_internal_model():
    wild = RationalModel(
        "a", "slip", np.zeros(0, complex), np.array([2.0 + 0j, -50.0]), 100.0, 0.01
    )
    assert "not stable" in internal_model(problem(wild)).reason


def test_a_controller_file_gives_the_controller_back():
    gains = designed(pid).controller
    assert isinstance(gains, Gains)
    law = gains.controller(Range(-0.05, 0.05, 5.0))
    tree = {
        "actuator": "throttle",
        "period": PERIOD,
        "limits": {"low": -0.05, "high": 0.05, "rate": 5.0},
        "law": {
            "kind": "pid",
            "proportional": law.proportional,
            "integral": law.integral,
            "derivative": law.derivative,
            "filter_time": law.filter_time,
            "tracking_time": law.tracking_time,
            "reference_weight": law.reference_weight,
        },
    }
    assert from_tree(tree).law == law
    shape = shaped(sampled(PATH, 0.003, PERIOD), 15.0)
    tree |= {
        "law": {
            "kind": "internal_model",
            "model": shape.model,
            "inverse": shape.inverse,
            "delay": shape.delay,
        }
    }
    again = from_tree(tree).law
    np.testing.assert_array_equal(again.inverse.A, shape.controller(FREE).inverse.A)


def test_the_better_law_is_closed_furthest_up_or_as_far_and_holds_more_off():
    found = [designed(d).margins["nominal"] for d in (internal_model, pid)]
    chosen = better(*(designed(d) for d in (internal_model, pid)))
    assert isinstance(chosen, Designed)
    alike = [m for m in found if m.bandwidth * SIMILAR >= max(m.bandwidth for m in found)]
    assert chosen.margins["nominal"] in alike
    assert chosen.margins["nominal"].rejection == max(m.rejection for m in alike)


def test_the_throttle_acts_as_the_spark_through_its_model():
    """M times the spark's path is the throttle's, but for the gain and a rest of the delay."""
    spark = RationalModel(
        "spark_command",
        "slip",
        np.zeros(0, complex),
        np.array([-17 + 51j, -17 - 51j, -90.0]),
        2200.0,
        0.002,
    )
    through, delay = later(problem(spark), problem())
    f = np.array([0.5, 2.0, 5.0, 9.0, 15.0])
    z = np.exp(2j * np.pi * f * PERIOD)
    ratio = PATH.response(f) / spark.response(f)
    ratio /= (PATH.response(np.zeros(1)) / spark.response(np.zeros(1)))[0]
    np.testing.assert_allclose(sections_response(through, z) * z**-delay, ratio, atol=0.01)


def test_sensor_noise_that_is_held_shakes_the_command_as_it_is_told():
    """Against the loop in time: a first-order path, noise drawn anew every 5 ms."""
    print("seed 4")
    slow = RationalModel("a", "slip", np.zeros(0, complex), np.array([-30.0]), 30.0, 0.004)
    told = Problem(slow, None, 0.0, PERIOD, 1.0, 0.05, sample_interval=0.005)
    gains = Gains(1.0, 20.0, 0.01, 0.005, PERIOD)
    noise = np.repeat(np.random.default_rng(4).standard_normal(8000), 5)
    law, x, line, commands = gains.controller(FREE), 0.0, [0.0] * 4, []
    state, a = law.start(0.0, 0.0, 0.0), np.exp(-30.0 * PERIOD)
    for n in noise:
        command, state = law.update(state, 0.0, x + n, PERIOD)
        line.append(command)
        x = a * x + (1 - a) * line.pop(0)
        commands.append(command)
    assert told.command_noise(gains.response) == pytest.approx(np.std(commands), rel=0.05)

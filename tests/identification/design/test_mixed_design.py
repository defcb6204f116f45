"""Throttle and spark designed together: between two loops that are good lies no bad one."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from slipbench.controllers.limits import Range
from slipbench.controllers.linear import in_series
from slipbench.controllers.two_actuators import TwoActuators
from slipbench.identification.design import mixed
from slipbench.identification.design.from_runs import Path
from slipbench.identification.design.loop import margins
from slipbench.identification.design.mixed import DEAD, PASSED, ZONE, Joint, Mixture, mixture
from slipbench.identification.design.sampled import sampled, sections
from slipbench.identification.design.steps import step_response
from slipbench.identification.design.widest import NoDesign
from slipbench.identification.models.rational_model import RationalModel
from tests.identification.design.test_loop_design import PERIOD, problem

SPARK_PATH = RationalModel(
    "spark_command",
    "slip",
    np.zeros(0, complex),
    np.array([-17 + 51j, -17 - 51j, -90.0]),
    2000.0,
    0.003,
)
FREE = Range(-100.0, 100.0)


def path(actuator: str, spark_delay: float = 0.003) -> Path:
    """A path without a set; what a spark moves is a twentieth of what a throttle does."""
    model = problem().model if actuator == "throttle" else replace(SPARK_PATH, delay=spark_delay)
    half_range = 0.06 if actuator == "throttle" else 0.17
    told = replace(problem(model), half_range=half_range, sample_interval=0.005, noise=1e-4)
    gain = float(model.response(np.zeros(1))[0].real)
    return Path(actuator, told, 50.0, gain, (actuator,), None)


@cache
def designed() -> Mixture:
    found = mixture(path("throttle"), path("spark"))
    assert isinstance(found, Mixture)
    return found


@pytest.mark.parametrize("passed", PASSED)
def test_the_nominal_sensitivity_is_a_mean_of_the_two_loops_own(passed):
    """S_n = (1 - n) S_t + n S_s, so that its peak lies below the greater one of theirs."""
    joint = designed().joint
    f = joint.ways[0].frequency
    f = f[f < 30.0]
    slow, fast = (
        s.inverse_response(f) * s.model_response(f) for s in (joint.throttle, joint.spark)
    )
    by_throttle, by_spark = joint.responses(f, passed)
    loop = by_throttle * joint.throttle.model_response(f) + by_spark * joint.spark.model_response(f)
    mean = 1 - (1 - passed) * slow - passed * fast
    np.testing.assert_allclose(
        1 / (1 + loop), mean, atol=0.02
    )  # M is a rational model of G_t / G_s
    own = [margins(f, t / (1 - t)).sensitivity for t in (slow, fast)]
    assert np.max(np.abs(1 / (1 + loop))) <= max(own) + 0.02


def test_every_share_of_the_spark_keeps_the_reserves():
    required = path("throttle").problem.required
    assert all(required.met(m) for m in designed().designed.margins.values())
    assert len(designed().designed.margins) == len(PASSED)


def test_the_dead_zone_covers_the_noise_and_leaves_the_spark_its_range():
    spread = mixed._command_noise(designed().joint)[1]
    assert designed().zone == pytest.approx(ZONE * spread)
    assert designed().zone <= DEAD * path("spark").problem.half_range


def test_noise_that_is_held_shakes_the_spark_as_it_is_told():
    """Against the loop in time, both models exact, the dead zone open."""
    print("seed 3")
    noise = np.repeat(np.random.default_rng(3).normal(0.0, 1e-4, 4000), 5)
    _, spark, _ = lived(designed().joint, noise, np.zeros(noise.size))
    assert np.std(spark[1000:]) == pytest.approx(
        mixed._command_noise(designed().joint)[1], rel=0.07
    )


def test_what_is_promised_for_a_target_comes_in_time():
    found, time = designed(), np.arange(0, 0.8, PERIOD)
    spark = path("spark").problem
    told = step_response(spark, found.joint, time, found.designed.prefilter.response)["nominal"]
    section = in_series((found.designed.prefilter.section,))
    x, target = np.zeros(section.B.size), []
    for _ in time:
        target.append(float(section.C @ x) + section.D)
        x = section.A @ x + section.B
    slip, sparks, _ = lived(found.joint, np.zeros(time.size), np.array(target))
    assert np.max(np.abs(told - slip)) < 0.02
    assert np.max(np.abs(sparks)) * abs(path("spark").gain) < 0.02  # the throttle does it all


def lived(joint: Joint, noise, target):
    """Slip, spark and throttle of the exact models under both, and noise on what is seen."""
    law = TwoActuators(
        joint.throttle.controller(FREE),
        joint.spark.controller(FREE),
        in_series(joint.later),
        joint.delay,
        0.0,
        joint.exchange,
    )
    plants = [sampled(p.model, p.extra, PERIOD) for p in joint.ways]
    linear = [in_series(sections(p.zeros, p.poles, p.gain)) for p in plants]
    states = [np.zeros(p.B.size) for p in linear]
    lines = [[0.0] * p.delay for p in plants]
    state, slip, found = law.start(0.0, 0.0, 0.0, 0.0), 0.0, []
    for n, r in zip(noise, target, strict=True):
        throttle, spark, state = law.update(state, float(r), slip + n, PERIOD)
        found.append((slip, spark, throttle))
        for k, command in enumerate((throttle, spark)):
            lines[k].append(command)
            states[k] = linear[k].A @ states[k] + linear[k].B * lines[k].pop(0)
        slip = sum(float(p.C @ x) for p, x in zip(linear, states, strict=True))
    return np.array(found).T


def test_the_later_the_spark_the_less_it_helps():
    found = [designed(), *(mixture(path("throttle"), path("spark", d)) for d in (0.02, 0.05))]
    reach = [m.designed.margins["nominal"].rejection for m in found if isinstance(m, Mixture)]
    alone = designed().target.margins["nominal"].rejection
    assert sorted(reach, reverse=True) == reach
    assert len(reach) == 3
    assert reach[-1] > alone


def test_a_throttle_without_a_design_is_told_as_such():
    wild = RationalModel(
        "a", "slip", np.zeros(0, complex), np.array([2.0 + 0j, -50.0]), 100.0, 0.01
    )
    unstable = replace(path("throttle"), problem=problem(wild))
    found = mixture(unstable, path("spark"))
    assert isinstance(found, NoDesign)
    assert found.reason.startswith("throttle: ")

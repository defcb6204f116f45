"""Held-out improvement by the identified effects, separate from that by calibration."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.mismatch.analysis import Analysis, begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.fit.held_out import held_out_simulations
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.improvement import (
    Improvement,
    improvement,
    interval_of_ratio,
)
from slipbench.identification.mismatch.reporting.improvement_in_words import improvement_in_words
from slipbench.identification.mismatch.simulation.written_units import SI
from tests.identification.mismatch.laws.spring import cubic, spring, swung

CUBE = 0.003  # 1/m^2
WANDER = 0.1  # m


def wandering(seed, size):
    """A sensor with slow drift, far larger than the change by the hardening."""
    rng = np.random.default_rng(seed + 7)
    lines = rng.uniform(0.1, 0.5, 8), rng.uniform(0.0, 2.0 * np.pi, 8)  # Hz, rad

    def sensed(x):
        t = 0.01 * np.arange(x.size)[:, None]
        return x + size * np.sin(2.0 * np.pi * lines[0] * t + lines[1]).sum(axis=1) / 2.0

    return sensed


def hardening(a: Analysis, cube=CUBE):
    """The effect of a spring that hardens."""
    kinds = (k for k in a.system.library if k.name == "cubic" and k.place.name == "deflection")
    return next(kinds)(cube=cube)


def compared(folder, cube, wander) -> Improvement:
    """Improvement by a hardening spring in the simulation of springs of this `cube`."""
    system = spring(folder)
    a = begin(
        system,
        *(
            [system.prepare(swung(s, cubic(cube), sensed=wandering(s, wander))) for s in seeds]
            for seeds in ((41, 42), (43, 44, 45))
        ),
    )
    origin = a.training.origin()
    base = calibrate(a.training, origin)
    found = calibrate(a.training, replace(origin, effects=(hardening(a),)))
    return improvement(*held_out_simulations(a.held_out, base, found)[1:])


def test_a_small_effect_beneath_a_large_error_shows_in_its_band_only(tmp_path):
    found = compared(tmp_path, CUBE, WANDER)
    place = found.of("place")
    assert not place.simulation.falls
    assert place.in_band.falls
    assert found.log_likelihood_gain > 0.0
    said = improvement_in_words(found, "place", SI)
    assert said.startswith("Held out, no simulation error falls measurably")
    assert "Hz of place falls by" in said
    assert f"log-likelihood gain {found.log_likelihood_gain:.0f} nats" in said


def test_the_same_effect_without_that_error_lets_the_simulation_error_fall(tmp_path):
    found = compared(tmp_path, CUBE, 0.0)
    assert found.of("place").simulation.falls
    assert "the simulation error of place falls by" in improvement_in_words(found, "place", SI)


def test_an_effect_that_is_not_there_improves_nothing(tmp_path):
    found = compared(tmp_path, 0.0, 0.0)
    place = found.of("place")
    assert not any(c.falls for c in (place.simulation, place.one_step, place.in_band))
    assert found.log_likelihood_gain < 0.0


def test_nothing_found_is_no_improvement_by_an_effect(tmp_path):
    system = spring(tmp_path)
    a = begin(system, *([system.prepare(swung(s))] for s in (46, 47)))
    analyse(a, [type(hardening(a))])
    assert a.errors
    assert verdict(a).improvement is None


@pytest.mark.parametrize("pieces", [5, 40])
def test_the_interval_of_a_ratio_holds_it_as_often_as_it_says(pieces):
    """Errors of two systems that share three quarters of their noise; the true ratio is 0.8."""
    print("seed 11")
    rng = np.random.default_rng(11)
    held = 0
    for _ in range(400):
        shared = rng.standard_normal((pieces, 30))
        one = 0.75**0.5 * shared + 0.25**0.5 * rng.standard_normal((pieces, 30))
        two = 0.8 * (0.75**0.5 * shared + 0.25**0.5 * rng.standard_normal((pieces, 30)))
        low, high = interval_of_ratio((one**2).sum(axis=1), (two**2).sum(axis=1))
        held += low <= 0.8 <= high
    assert 0.92 <= held / 400 <= 0.98


def test_too_few_pieces_of_time_give_no_interval():
    low, high = interval_of_ratio(np.ones(3), np.full(3, 0.1))
    assert (low, high) == (0.0, float("inf"))

"""Effects at an unknown place, phase or speed: detected at any value, without false alarms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate

from slipbench.identification.mismatch.reporting.verdict import Verdict
from slipbench.plant.effects.compression_torque import CompressionTorque
from slipbench.plant.effects.eccentricity import Eccentricity
from slipbench.plant.effects.torque_dip import TorqueDip
from slipbench.plant.effects.wet_patch import WetPatch
from slipbench.plant.effects.wind import Wind
from tests.identification.mismatch.laws.explained import effect, holds, names, reported
from tests.identification.mismatch.laws.motorcycle import LEARN, PROVE, ridden, values
from tests.identification.motorcycle_recording import Ride

ROAD = ("wet_patch", "grade", "driveline_loss")
TOOTH = ("eccentricity", "tooth_misplacement", "driveline_loss")
SWING, CYLINDERS = 60.0, 3
RUN_OUT = 5e-3
WINDY = 40.0  # N
LOSS, PLACE, LENGTH = 0.4, 60.0, 20.0  # 1, m, m


def test_a_torque_that_turns_with_the_crank_is_named_though_no_channel_shows_its_phase():
    """Each recording begins at another crank angle, which is estimated from the torque line."""
    found = ridden(
        CompressionTorque(swing=SWING, cylinders=CYLINDERS),
        library=("compression_torque", "backlash", "driveline_loss"),
    )
    assert names(found) == ["compression_torque"], reported(found)
    estimates = {p.name: p.value for p in effect(found, "compression_torque").parameters}
    assert estimates["cylinders"] == CYLINDERS
    assert holds(found, "compression_torque", "swing", SWING, slack=0.02)


@pytest.mark.parametrize("phase", [1.57, -2.4])
def test_a_run_out_is_named_at_any_phase(phase):
    """A score test at one phase, or at that and its opposite, is blind a quarter turn away."""
    found = ridden(Eccentricity(run_out=RUN_OUT, phase=phase), library=TOOTH)
    assert [e.name for e in found.effects] == ["eccentricity"], reported(found)
    assert holds(found, "eccentricity", "run_out", RUN_OUT, slack=0.02)


def test_a_torque_dip_is_named_far_from_its_usual_speed():
    """The usual centre is 1410 rad/s; these rides reach 1050."""
    found = ridden(
        TorqueDip(depth=6.0, centre=1050.0),
        library=("torque_dip", "driveline_loss", "asymmetric_filling"),
    )
    assert names(found) == ["torque_dip"], reported(found)
    assert holds(found, "torque_dip", "centre", 1050.0, slack=0.01)


def windy(rides: tuple[Ride, ...]) -> tuple[Ride, ...]:
    return tuple(replace(r, wind=WINDY) for r in rides)


def test_wind_is_neither_a_grade_nor_a_wet_patch_nor_another_drag():
    """A magnitude at one place is compared with its scatter at placebo locations and trials."""
    library = (*ROAD, "wind", "air_density", "closed_throttle_friction")
    found = ridden(library=library, training=windy(LEARN), held_out=windy(PROVE))
    assert not found.mismatch, reported(found)
    assert not found.effects


@pytest.mark.parametrize("period", [5.0, 6.4])
def test_gusts_are_named_at_a_period_that_is_not_the_typical_one(period):
    """The phase at the end of a recording follows from the period: a near one has no correlation."""
    gusts = Wind(head_wind=6.0, gust=3.0, gust_period=period)
    library = (*ROAD, "wind", "air_density", "closed_throttle_friction")
    rides, proofs = (tuple(replace(r, seconds=18.0) for r in rs) for rs in (LEARN, PROVE))
    found = ridden(gusts, library=library, training=rides, held_out=proofs)
    assert names(found) == ["wind"], reported(found)
    assert holds(found, "wind", "gust_period", period, slack=0.05)


@pytest.fixture(scope="module")
def wet() -> Verdict:
    return ridden(WetPatch(loss=LOSS, place=PLACE, length=LENGTH), library=ROAD)


def test_a_wet_patch_is_named_where_it_lies(wet):
    assert names(wet) == ["wet_patch"], reported(wet)
    assert holds(wet, "wet_patch", "place", PLACE, slack=0.05)
    assert holds(wet, "wet_patch", "loss", LOSS, slack=0.01)


@pytest.mark.parametrize(("parameter", "truth"), [("place", PLACE), ("length", LENGTH)])
def test_the_intervals_of_its_ends_hold_the_truth(wet, parameter, truth):
    assert holds(wet, "wet_patch", parameter, truth)


def other_texture(time: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """An optical sensor that reads 1 % high over 80 m of the road."""
    distance = integrate.cumulative_trapezoid(speed, time, initial=0.0)
    return np.where((distance > 70.0) & (distance < 150.0), 1.01 * speed, speed)


def test_a_stretch_of_road_on_which_a_sensor_errs_is_located():
    """It is short compared with the ride: a curve over distance with few knots missed it."""
    rides = (
        *LEARN,
        Ride("sweep", 3, 1150.0, 0.04, 0.5, 9.0, seed=34),
        Ride("multisine", 2, 1250.0, 0.035, 0.6, 14.0, seed=35),
    )
    training, held_out = (tuple(replace(r, seconds=9.0) for r in rs) for rs in (rides, PROVE))
    change = values("optical_speed", other_texture)
    found = ridden(library=ROAD, change=change, training=training, held_out=held_out)
    assert found.mismatch, reported(found)
    assert not found.effects
    assert found.location is not None
    assert found.location.injection == "sensor of optical speed", reported(found)
    assert "distance" in found.location.regressor, reported(found)

"""Laws of the effects of tyre and road: each does what its equation says."""

import math
from dataclasses import replace

import numpy as np
import pytest

from slipbench.plant.effects.grade import Grade
from slipbench.plant.effects.grip_temperature import GripTemperature
from slipbench.plant.effects.grip_wear import GripWear
from slipbench.plant.effects.load_transfer import LoadTransfer
from slipbench.plant.effects.radius_growth import RadiusGrowth
from slipbench.plant.effects.radius_with_lean import RadiusWithLean
from slipbench.plant.effects.relaxation_length import RelaxationLength
from slipbench.plant.effects.squat import Squat
from slipbench.plant.effects.wet_patch import WetPatch
from slipbench.plant.effects.wind import Wind
from slipbench.plant.motorcycle import Motorcycle

BIKE = Motorcycle()
SPINNING = {"rear_speed": 400.0}  # far beyond the peak of the curve


@pytest.mark.parametrize("speed", [15.0, 40.0])
def test_the_force_settles_over_a_length_not_a_time(moment, speed):
    at = {"speed": speed, "rear_speed": 1.01 * speed / BIKE.rear_wheel.radius}
    relaxing = moment(RelaxationLength(length=0.3), **at)
    assert relaxing["tyre_force"] == 0.0
    static = relaxing["d relaxation_length.force"] * 0.3 / speed
    assert static == pytest.approx(moment(**at)["tyre_force"])


def test_acceleration_presses_by_mass_and_height(moment, nominal):
    """Peak and slope grow alike: the curve is that of a heavier load."""
    felt, height = 4.0, 0.5
    load = nominal.tyre.load + nominal.body.mass * height * felt
    seen = moment(LoadTransfer(height=height), load_transfer__felt=felt)
    assert seen["tyre_force"] == pytest.approx(moment(load=load / nominal.tyre.load)["tyre_force"])
    rate = (seen["acceleration"] - felt) / LoadTransfer().settling
    assert seen["d load_transfer.felt"] == pytest.approx(rate)


def test_a_wheelie_is_the_end_of_load_transfer(moment, nominal):
    most = nominal.body.mass * 9.80665 / nominal.tyre.load
    seen = moment(LoadTransfer(), load_transfer__felt=1e3)["tyre_force"]
    assert seen == pytest.approx(moment(load=most)["tyre_force"])
    assert abs(moment(LoadTransfer(), load_transfer__felt=-1e3)["tyre_force"]) < 0.01


def test_radii_grow_with_the_square_of_the_speed(moment):
    effect = RadiusGrowth(growth=1e-5, front_growth=4e-6)
    for speed in (20.0, 60.0):
        seen, plain = (moment(*e, speed=speed, rear_speed=200.0) for e in ((effect,), ()))
        rolling = (seen["slip"] + 1) / (plain["slip"] + 1)
        assert rolling == pytest.approx(1 + 1e-5 * speed**2)
        turning = plain["front_speed"] / seen["front_speed"]
        assert turning == pytest.approx(1 + 4e-6 * speed**2)


@pytest.mark.parametrize("lean", [0.8, -0.8])
def test_a_leaning_tyre_rolls_on_a_smaller_circle(moment, lean):
    effect = RadiusWithLean(crown=0.1, front_crown=0.06)
    seen, upright = moment(effect, lean=lean), moment(effect)
    shrunk = 1 - 0.06 * (1 - math.cos(lean)) / BIKE.front_wheel.radius
    assert upright["front_speed"] / seen["front_speed"] == pytest.approx(shrunk)
    shrunk = 1 - 0.1 * (1 - math.cos(lean)) / BIKE.rear_wheel.radius
    assert (seen["slip"] + 1) / (upright["slip"] + 1) == pytest.approx(shrunk)


def test_a_warm_tyre_loses_its_peak_and_hardly_its_slope(moment):
    effect = GripTemperature(sensitivity=-3e-3)
    for at, lost in ((SPINNING, 0.12), ({"rear_speed": 53.0 / 0.32 * 1.001}, 0.0)):
        cold = moment(effect, **at)["tyre_force"]
        warm = moment(effect, grip_temperature__warmth=40.0, **at)["tyre_force"]
        assert 1 - warm / cold == pytest.approx(lost, abs=0.03)


def test_sliding_heats_by_its_power_and_cools_with_its_time(moment):
    effect = GripTemperature(heating=0.1, cooling=20.0)
    seen = moment(effect, grip_temperature__warmth=30.0, **SPINNING)
    power = seen["tyre_force"] * (400.0 * BIKE.rear_wheel.radius - 53.0)
    assert seen["d grip_temperature.warmth"] == pytest.approx((0.1 * power - 30.0) / 20.0)


def test_wear_takes_the_same_from_every_kilometre(moment):
    effect = GripWear(wear=1e-5)
    for distance in (1e3, 5e3):
        seen = moment(effect, distance=distance)["tyre_force"]
        assert seen == pytest.approx(moment(grip=1 - 1e-5 * distance)["tyre_force"])


def test_a_swing_of_the_suspension_presses_the_tyre(moment, nominal):
    effect = Squat(share=0.5, frequency=20.0, damping=0.3)
    seen = moment(effect, squat__settled=100.0, squat__settling=2000.0)
    load = nominal.tyre.load + 0.5 * 2000.0 / 20.0
    assert seen["tyre_force"] == pytest.approx(moment(load=load / nominal.tyre.load)["tyre_force"])
    push = 20.0 * (20.0 * (seen["tyre_force"] - 100.0) - 0.6 * 2000.0)
    assert seen["d squat.settling"] == pytest.approx(push)
    assert seen["d squat.settled"] == 2000.0


def test_steady_force_does_not_squat(ridden):
    plain, seen = ridden(), ridden(Squat())
    assert seen.slip == pytest.approx(plain.slip, abs=1e-9)


def test_one_per_cent_of_slope_weighs_one_per_cent_of_the_weight(moment, nominal):
    effect = Grade(slope=0.01, place=100.0, length=200.0)
    lost = [
        moment()["acceleration"] - moment(effect, distance=distance)["acceleration"]
        for distance in (0.0, 200.0, 400.0)
    ]
    assert lost == pytest.approx([0.0, 0.0980665, 0.0], abs=1e-6)


def test_wind_from_ahead_is_speed_through_the_air(moment, nominal):
    still = replace(nominal.body, rolling_resistance=0.0)
    effect = Wind(head_wind=7.0, gust=0.0)
    lost = moment()["acceleration"] - moment(effect)["acceleration"]
    drag = 0.5 * still.air_density * still.drag_area / still.mass
    assert lost == pytest.approx(drag * ((53.0 + 7.0) ** 2 - 53.0**2))


def test_a_patch_takes_its_share_of_the_grip_at_its_place_only(moment):
    effect = WetPatch(loss=0.4, place=100.0, length=20.0)
    for distance, grip in ((80.0, 1.0), (110.0, 0.6), (140.0, 1.0)):
        seen = moment(effect, distance=distance, **SPINNING)["tyre_force"]
        assert seen == pytest.approx(moment(grip=grip, **SPINNING)["tyre_force"])


def test_more_slip_is_seen_where_the_road_is_wet(ridden):
    out = ridden(WetPatch(loss=0.8, place=10.0, length=5.0), seconds=0.6)
    inside = (out.distance > 12.0) & (out.distance < 13.0)
    assert out.slip[inside].mean() > 1.2 * out.slip[out.distance < 7.0].mean()
    assert np.isfinite(out.table).all()

"""Laws of the effects in engine and driveline: each does what its equation says."""

import math
from dataclasses import replace

import numpy as np
import pytest

from slipbench.plant.effects.air_density import AirDensity
from slipbench.plant.effects.backlash import Backlash, dead_zone
from slipbench.plant.effects.chain_polygon import ChainPolygon
from slipbench.plant.effects.closed_throttle_friction import ClosedThrottleFriction
from slipbench.plant.effects.clutch_slip import ClutchSlip
from slipbench.plant.effects.compression_torque import CompressionTorque
from slipbench.plant.effects.driveline_loss import DrivelineLoss
from slipbench.plant.effects.firing_torque import FiringTorque
from slipbench.plant.effects.hardening_cush import HardeningCush
from slipbench.plant.effects.slipper_clutch import SlipperClutch
from slipbench.plant.effects.spark_clip import SparkClip
from slipbench.plant.effects.spark_curvature import SparkCurvature
from slipbench.plant.effects.torque_dip import TorqueDip
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Inputs
from slipbench.plant.simulation import Simulation

RATIO = Motorcycle().gears[1]


def test_the_dip_is_as_deep_as_it_says_and_a_bell_wide(moment):
    effect = TorqueDip(depth=6.0, centre=1400.0, width=70.0)
    for away, share in ((0.0, 1.0), (70.0, math.exp(-0.5)), (700.0, 0.0)):
        speed = 1400.0 + away
        lost = moment(engine_speed=speed)["engine_torque"]
        lost -= moment(effect, engine_speed=speed)["engine_torque"]
        assert lost == pytest.approx(6.0 * share, abs=1e-9)


def test_a_closed_throttle_brakes_more_in_proportion_to_speed(moment):
    effect = ClosedThrottleFriction(pumping=5.0, opening=0.03)
    for speed in (600.0, 1200.0):
        at = {"engine_speed": speed, "air": 0.0, "throttle": 0.0}
        braking = moment(**at)["engine_torque"] - moment(effect, **at)["engine_torque"]
        assert braking == pytest.approx(5e-3 * speed)
    wide = moment(air=0.5)["engine_torque"]
    assert moment(effect, air=0.5)["engine_torque"] == pytest.approx(wide, rel=1e-6)


def test_torque_over_spark_is_a_hill_with_its_summit_where_slope_and_curvature_meet(
    moment, nominal
):
    gain, curvature = nominal.engine.spark_gain, 2.0
    summit = gain / (2 * curvature)
    effect = SparkCurvature(curvature=curvature)
    best, early, late = (
        moment(effect, spark=summit + d)["engine_torque"] for d in (0.0, 0.05, -0.05)
    )
    assert early == pytest.approx(late)
    assert 1 - early / best == pytest.approx(curvature * 0.05**2 / (1 + gain * summit / 2))


def test_spark_beyond_the_clip_does_nothing_more(moment):
    effect = SparkClip(limit=0.06)
    for asked, acting in ((0.03, 0.03), (0.2, 0.06), (-0.2, -0.06)):
        clipped = moment(effect, spark=asked)["engine_torque"]
        assert clipped == pytest.approx(moment(spark=acting)["engine_torque"])


def test_full_load_goes_with_pressure_and_the_root_of_the_temperature(nominal, moment):
    effect = AirDensity(pressure=-0.1, exponent=0.5, warming=0.0)
    thin = moment(effect, air=9.0, air_temperature=4 * 298.15)["engine_torque"]
    assert thin / moment(air=9.0)["engine_torque"] == pytest.approx(0.9 / 2)


def test_the_air_box_warms_up_with_its_own_time(nominal):
    warm, cold = AirDensity(0.0, 1.0, 30.0, 1.0), AirDensity(0.0, 1.0, 0.0)
    torque = []
    for effect in (warm, cold):
        simulation = Simulation(replace(nominal, effects=(effect,)))
        state = simulation.state(air=1.0, throttle=1.0, throttle_command=1.0, engine_speed=1200.0)
        hold = {"measured_engine_speed": 1200.0, "measured_throttle": 1.0}
        inputs = Inputs.held(2000, gear=0.0, throttle_command=1.0, **hold)
        torque.append(simulation.advance(state, inputs)[1].engine_torque[-1])
    friction = nominal.engine.friction + nominal.engine.friction_rise * 1200.0
    lost = 298.15 / (298.15 + 30.0 * (1 - math.exp(-2.0 / 1.0)))
    filled = 1 - math.exp(-1.0 / nominal.engine.opening_scale)
    full = (torque[1] + friction * (1 - filled)) / filled
    expected = full * lost * filled - friction * (1 - filled)
    assert torque[0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("effect", [FiringTorque(), CompressionTorque(), FiringTorque(cylinders=3)])
def test_the_swing_of_the_torque_means_nothing_over_two_turns(moment, effect):
    angles = 4 * np.pi * np.arange(48) / 48
    swing = [moment(effect, crank_angle=angle)["engine_torque"] for angle in angles]
    assert np.mean(swing) == pytest.approx(moment()["engine_torque"])
    assert np.ptp(swing) > 10.0


def test_firing_grows_with_load_and_compression_does_not(moment):
    angle = math.pi / 4  # the summit of order two
    for effect, grows in ((FiringTorque(spread=0.0), True), (CompressionTorque(), False)):
        swing = [
            abs(
                moment(effect, air=air, crank_angle=angle)["engine_torque"]
                - moment(air=air)["engine_torque"]
            )
            for air in (0.05, 0.3)
        ]
        assert (swing[1] > 2 * swing[0]) == grows
        assert grows or swing[1] == pytest.approx(swing[0])


def test_order_two_of_the_crank_stands_in_the_engine_speed(ridden, nominal):
    """J w' = A sin(2 psi): the speed swings by A / (2 J w), the driveline being soft to it."""
    out = ridden(CompressionTorque(swing=40.0))
    w = out.engine_speed.mean()
    wave = np.exp(-2j * out.crank_angle)
    line = 2 * abs(np.mean((out.engine_speed - w) * wave))
    assert line == pytest.approx(40.0 / (2 * nominal.engine.inertia * w), rel=0.03)


def test_the_crank_keeps_in_step_with_a_recorded_wheel_and_nothing_else_changes(ridden, nominal):
    """Told a wheel that turns a hundredth faster, the crank's angle gains what that wheel gains."""
    alone = ridden(seconds=0.2)
    faster = 1.01 * alone.rear_speed[-1]
    kept = ridden(seconds=0.2, kept_rear_speed=faster)
    gained = nominal.gears[1] * (faster - alone.rear_speed[-1]) * alone.time[-1]
    assert kept.crank_angle[-1] - alone.crank_angle[-1] == pytest.approx(gained, rel=1e-9)
    for column in ("engine_speed", "rear_angle", "speed", "twist"):
        assert (kept[column] == alone[column]).all()


def test_nothing_is_passed_inside_the_gap(moment):
    for twist in np.linspace(-0.0099, 0.0099, 7):
        at = {"twist": twist, "engine_speed": 900.0, "rear_speed": 100.0}
        assert moment(Backlash(slack=0.02), **at)["driveline_torque"] == 0.0


def test_beyond_the_gap_the_spring_is_nominal():
    twist, rate = dead_zone(0.05, 2.0, slack=0.01, softness=0.2)
    assert twist == pytest.approx(0.045)
    assert rate == 2.0


def test_torque_is_continuous_across_the_gap(nominal):
    twists = np.linspace(-0.02, 0.02, 4001)
    seen = np.array([dead_zone(x, 3.0, slack=0.012, softness=0.2) for x in twists])
    torque = nominal.driveline.stiffness * seen[:, 0] + nominal.driveline.damping * seen[:, 1]
    slope = nominal.driveline.stiffness + nominal.driveline.damping * 3.0 / (0.2 * 0.012)
    assert np.abs(np.diff(torque)).max() <= 1.01 * slope * (twists[1] - twists[0])


def test_a_loaded_driveline_does_not_know_of_its_slack(ridden):
    wave = 0.005 * np.sin(50e-3 * np.arange(500))
    seen = [ridden(*effects, throttle_command=wave) for effects in ((), (Backlash(slack=5e-3),))]
    assert seen[0].slip == pytest.approx(seen[1].slip, abs=1e-9)


def test_stiffness_grows_with_the_square_of_the_twist(moment, nominal):
    rest = {"engine_speed": 167.0 * RATIO, "rear_speed": 167.0}
    for twist in (-0.05, 0.1):
        torque = moment(HardeningCush(hardening=100.0), twist=twist, **rest)["driveline_torque"]
        expected = nominal.driveline.stiffness * twist * (1 + 100.0 * twist**2)
        assert torque == pytest.approx(expected)


@pytest.mark.parametrize("twist", [0.05, -0.05])
def test_the_wheel_gets_less_and_gives_more(moment, nominal, twist):
    at = {"twist": twist, "engine_speed": 167.0 * RATIO, "rear_speed": 167.0}
    lost = moment(**at)["d rear_speed"] - moment(DrivelineLoss(loss=0.05), **at)["d rear_speed"]
    torque = abs(moment(**at)["driveline_torque"])
    assert lost * nominal.rear_wheel.inertia == pytest.approx(0.05 * torque)


def test_a_worn_clutch_has_a_ceiling_and_lets_the_engine_run_up(ridden):
    out = ridden(ClutchSlip(capacity=60.0), throttle_command=np.full(500, 0.5))
    assert out.driveline_torque.max() == pytest.approx(60.0 * RATIO)
    assert (out.engine_speed / RATIO - out.rear_speed)[-1] > 5.0


def test_the_slipper_has_a_ceiling_when_braking_only(ridden):
    wave = np.repeat([-1.0, 0.4], 250)
    plain, out = ridden(throttle_command=wave), ridden(SlipperClutch(5.0), throttle_command=wave)
    assert plain.driveline_torque.min() < -6.0 * RATIO
    assert out.driveline_torque.min() == pytest.approx(-5.0 * RATIO)
    assert out.driveline_torque.max() > 60.0 * RATIO


def test_the_chain_adds_a_line_at_the_order_of_its_sprocket(ridden):
    """Torque c e w at order z, and k e / z in quadrature: the driveline stands still to it."""
    effect = ChainPolygon(ripple=5e-3, teeth=20)
    out, nominal = ridden(effect), Motorcycle()
    torque = out.driveline_torque - out.driveline_torque.mean()
    line = 2 * abs(np.mean(torque * np.exp(-20j * out.rear_angle)))
    spring = nominal.driveline.stiffness * 5e-3 / 20
    damper = nominal.driveline.damping * 5e-3 * out.rear_speed.mean()
    assert line == pytest.approx(math.hypot(spring, damper), rel=0.1)

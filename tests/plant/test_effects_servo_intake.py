"""Laws of the effects in throttle servo and intake: each does what its equation says."""

import numpy as np
import pytest

from slipbench.plant.effects.acceleration_limit import AccelerationLimit
from slipbench.plant.effects.air_box_delay import AirBoxDelay
from slipbench.plant.effects.asymmetric_filling import AsymmetricFilling
from slipbench.plant.effects.crank_angle_delay import CrankAngleDelay
from slipbench.plant.effects.fuel_film import FuelFilm
from slipbench.plant.effects.gear_play import GearPlay
from slipbench.plant.effects.rate_limit import RateLimit
from slipbench.plant.effects.runner_resonance import RunnerResonance
from slipbench.plant.effects.spring_knee import SpringKnee
from slipbench.plant.effects.throttle_stiction import ThrottleStiction
from slipbench.plant.effects.voltage_limit import VoltageLimit
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Inputs, Outputs
from slipbench.plant.simulation import Simulation

W = Motorcycle().throttle_servo.natural_frequency


def moved(effect: object, command: np.ndarray, start: float = 0.1) -> Outputs:
    """The plate alone, in neutral, a row a millisecond."""
    simulation = Simulation(Motorcycle(effects=(effect,)))
    own = {f"{effect.name}.{state}": start for state in effect.states}
    state = simulation.state(throttle=start, air=start, throttle_command=start, **own)
    return simulation.advance(state, Inputs.held(len(command), gear=0.0, throttle_command=command))[
        1
    ]


def test_the_plate_is_never_faster_than_its_limit():
    limit = 3.0
    out = moved(RateLimit(limit=limit), np.repeat([0.9, 0.1, 0.6], 400))
    velocity = np.diff(out.throttle) / 0.25e-3
    assert np.abs(velocity).max() <= limit * (1 + 1e-9)
    assert velocity.max() == pytest.approx(limit, rel=1e-6)
    assert out.throttle[-1] == pytest.approx(0.6, abs=1e-4)


def test_the_plate_never_gains_speed_faster_than_its_limit():
    limit = 150.0
    out = moved(AccelerationLimit(limit=limit), np.repeat([0.4, 0.3], 300), start=0.3)
    gain = np.diff(out.throttle_rate) / 0.25e-3
    assert np.abs(gain).max() == pytest.approx(limit, rel=1e-6)


@pytest.mark.parametrize(("rate", "error"), [(0.0, 0.5), (6.0, 0.9), (-6.0, -0.9)])
def test_the_push_that_is_left_falls_linearly_with_speed(moment, rate, error):
    effect = VoltageLimit(stall_acceleration=300.0, no_load_speed=12.0)
    seen = moment(effect, throttle=0.1, throttle_rate=rate, throttle_command=0.1 + error)
    left = 300.0 * (1 - abs(rate) / 12.0)
    assert seen["d throttle_rate"] == pytest.approx(np.sign(error) * left)


def test_an_error_below_the_width_does_not_move_the_plate_and_one_above_does():
    effect = ThrottleStiction(width=5e-3)
    still = moved(effect, np.full(1000, 0.1 + 4.5e-3))
    gone = moved(effect, np.full(200, 0.1 + 15e-3))
    assert np.ptp(still.throttle) < 2.0 * effect.presliding
    assert np.ptp(still.throttle[2000:]) < 1e-6  # it holds, for as long as it likes
    assert gone.throttle[-1] - 0.1 > 8e-3


def test_friction_opposes_the_motion_and_falls_from_breakaway_to_sliding(moment):
    effect = ThrottleStiction(width=4e-3, breakaway=2.0, stribeck_speed=0.2)
    held = []
    for rate in (0.05, 2.0, -2.0):
        slides = moment(effect, throttle_rate=rate, throttle_stiction__bristle=np.sign(rate))
        free = moment(throttle_rate=rate)
        held.append((free["d throttle_rate"] - slides["d throttle_rate"]) / (W**2 * 4e-3))
    assert held == pytest.approx([1 + np.exp(-(0.25**2)), 1.0, -1.0], rel=1e-3)


def test_after_a_reversal_the_plate_waits_for_the_gap_to_close():
    play = 6e-3
    command = 0.1 + 0.01 * np.concatenate([np.linspace(0, 1, 2000), np.linspace(1, -1, 4000)])
    plate = moved(GearPlay(play=play), command).throttle[3::4]
    late = 600  # ms, past the servo's own dynamics
    assert plate[1999] == pytest.approx(command[1999] - play / 2, abs=1e-4)
    assert np.ptp(plate[2000:3100]) < 2e-4
    assert plate[-1] == pytest.approx(command[-1] + play / 2, abs=1e-4)
    assert plate[-1] - plate[-late] == pytest.approx(command[-1] - command[-late], abs=1e-4)


def test_a_motion_within_the_play_passes_nothing():
    command = 0.1 + 2e-3 * np.sin(0.05 * np.arange(500))
    assert np.ptp(moved(GearPlay(play=5e-3), command).throttle) < 1e-12


def test_below_home_the_plate_stands_where_both_springs_balance():
    effect = SpringKnee(stiffness=0.5, home=0.08)
    assert moved(effect, np.full(800, 0.04)).throttle[-1] == pytest.approx(
        (0.04 + 0.5 * 0.08) / 1.5, rel=1e-6
    )
    assert moved(effect, np.full(800, 0.12)).throttle[-1] == pytest.approx(0.12, rel=1e-6)


def test_delays_add_up_and_count_turns_of_the_crank(moment):
    plain = moment()["air_delay"]
    assert moment(AirBoxDelay(delay=7e-3))["air_delay"] == pytest.approx(plain + 7e-3)
    for speed in (700.0, 1400.0):
        turned = moment(CrankAngleDelay(turns=2.0), engine_speed=speed)["air_delay"] - plain
        assert turned * speed == pytest.approx(4 * np.pi)


def test_closing_takes_longer_by_the_asymmetry(moment, nominal):
    effect = AsymmetricFilling(asymmetry=0.7)
    opening, closing = (moment(effect, throttle=0.3, air=air)["d air"] for air in (0.2, 0.4))
    assert opening == pytest.approx(0.1 / nominal.intake.filling_time)
    assert -opening / closing == pytest.approx(1.7)


def test_the_runner_answers_most_at_its_own_frequency():
    """A sine of the air comes out 1 / (2 z) times as large, a quarter of a period late."""
    frequency, damping = 2 * np.pi * 30, 0.2
    effect = RunnerResonance(share=1.0, frequency=frequency, damping=damping)
    t = np.arange(1500) * 1e-3
    out = moved(effect, 0.1 + 0.01 * np.sin(frequency * t))
    late = slice(-4000, None)
    swing, air = out["runner_resonance.swing"][late] - 0.1, out.air[late] - 0.1
    wave = np.exp(-1j * frequency * out.time[late])
    answer = (swing @ wave) / (air @ wave)
    assert answer == pytest.approx(-1j / (2 * damping), rel=0.01)


def test_a_share_of_the_fuel_comes_later(moment):
    """Right after opening the film lacks its share; when it has settled nothing does."""
    rich = moment(air=0.12)["engine_torque"]
    opened = moment(FuelFilm(share=0.25), air=0.2, fuel_film__film=0.04 / 0.5)
    assert opened["d fuel_film.film"] == pytest.approx((0.2 - 0.08) / 0.2)
    lean = moment(FuelFilm(share=0.25), air=0.12, fuel_film__film=0.0)["engine_torque"]
    assert lean == pytest.approx(moment(air=0.09)["engine_torque"])
    assert moment(FuelFilm(share=0.25), air=0.12, fuel_film__film=0.12)[
        "engine_torque"
    ] == pytest.approx(rich)

"""Laws of every effect in the library, then what each one's page promises."""

from dataclasses import replace

import numpy as np
import pytest

from plant.composition import kernel_text
from plant.effects.asymmetric_filling import AsymmetricFilling
from plant.effects.backlash import Backlash, dead_zone
from plant.effects.effect import SECTIONS, Effect, Hook
from plant.effects.library import LIBRARY
from plant.effects.optical_lag import OpticalLag
from plant.effects.rate_limit import RateLimit
from plant.effects.relaxation_length import RelaxationLength
from plant.encoder import begin, passing_teeth, toothed_disc
from plant.equations import EQUATIONS
from plant.equilibrium import equilibrium
from plant.motorcycle import BLOCK_NAMES, Motorcycle
from plant.signals import Inputs, Outputs
from plant.simulation import Simulation
from plant.trouble import ParameterError

every_effect = pytest.mark.parametrize("effect", LIBRARY, ids=lambda e: e.name)


def with_effects(motorcycle: Motorcycle, *effects: Effect) -> Motorcycle:
    return replace(motorcycle, effects=effects)


def rear_ticks(motorcycle: Motorcycle, out: Outputs) -> np.ndarray:
    disc = toothed_disc(motorcycle.rear_encoder, motorcycle.effects)
    start = begin(0.0, 0.0, out.rear_speed[0])
    return passing_teeth(disc, start, out.time, out.rear_angle, out.rear_speed)[1].ticks


@every_effect
def test_an_absent_effect_changes_nothing(effect, nominal, swept):
    bare, absent = with_effects(nominal), with_effects(nominal, effect.absent())
    plain, seen = swept(bare, every_ms=False), swept(absent, every_ms=False)
    n = len(Outputs.names)
    scale = np.ptp(plain.table[:, :n], axis=0) + 1.0
    assert (np.abs(seen.table[:, :n] - plain.table[:, :n]) / scale).max() < 1e-12
    assert (rear_ticks(bare, plain) == rear_ticks(absent, seen)).all()


REACHED_ONLY_IF_SMALL = {RateLimit: RateLimit(limit=1.0)}


@every_effect
def test_an_effect_of_a_size_that_is_reached_leaves_a_trace(effect, nominal, swept):
    present = with_effects(nominal, REACHED_ONLY_IF_SMALL.get(effect, effect()))
    plain, seen = swept(nominal), swept(present)
    n = len(Outputs.names)
    in_motion = np.abs(seen.table[:, :n] - plain.table[:, :n]).max() > 1e-6
    in_teeth = not np.array_equal(rear_ticks(nominal, plain), rear_ticks(present, plain))
    assert in_motion or in_teeth


@every_effect
def test_an_effect_is_one_page_in_the_fixed_order(effect):
    page = effect.page()
    assert list(page) == ["Title", "Physics", *SECTIONS]
    assert all(page.values())
    for described in effect.parameters():
        assert described.name in page["Symbols"]


@every_effect
def test_an_effect_acts_at_seams_that_exist_and_belongs_to_a_block(effect):
    seams = {equation.__name__ for equation in EQUATIONS}
    assert {hook.seam for hook in effect.hooks} <= seams
    assert effect.block in (*BLOCK_NAMES, "optical_sensor", "road")
    governed = [state for hook in effect.hooks for state in hook.governs]
    assert sorted(governed) == sorted(effect.states)


def test_an_effect_is_given_once_and_within_its_range():
    with pytest.raises(ParameterError, match="given 2 times"):
        Motorcycle(effects=(Backlash(), Backlash(slack=1e-3)))
    with pytest.raises(ParameterError, match=r"Backlash\.slack.*0 to 0\.1 rad.*found 8"):
        Backlash(slack=8)


def test_an_unknown_argument_of_a_hook_is_named():
    class Wrong(Backlash):
        name = "wrong"
        hooks = (Hook("spring_motion", lambda_with_typo),)

    with pytest.raises(NameError, match="'spring_twits' is neither"):
        kernel_text((Wrong,))


def lambda_with_typo(spring_twits: float) -> float:
    return spring_twits


# Backlash


def test_nothing_is_passed_inside_the_gap(nominal):
    bike = with_effects(nominal, Backlash(slack=0.02))
    simulation = Simulation(bike)
    for twist in np.linspace(-0.0099, 0.0099, 7):
        state = simulation.state(twist=twist, engine_speed=900.0, rear_speed=100.0)
        _, out = simulation.instant(simulation.states(state), simulation.row(2, 0.1))
        assert out.driveline_torque[0] == 0.0


def test_beyond_the_gap_the_spring_is_nominal(nominal):
    twist, rate = dead_zone(0.05, 2.0, slack=0.01, softness=0.2)
    assert twist == pytest.approx(0.045)
    assert rate == 2.0


def test_torque_is_continuous_across_the_gap(nominal):
    twists = np.linspace(-0.02, 0.02, 4001)
    seen = np.array([dead_zone(x, 3.0, slack=0.012, softness=0.2) for x in twists])
    torque = nominal.driveline.stiffness * seen[:, 0] + nominal.driveline.damping * seen[:, 1]
    slope = nominal.driveline.stiffness + nominal.driveline.damping * 3.0 / (0.2 * 0.012)
    assert np.abs(np.diff(torque)).max() <= 1.01 * slope * (twists[1] - twists[0])


def test_a_loaded_driveline_does_not_know_of_its_slack(nominal):
    seen = []
    for effects in ((), (Backlash(slack=5e-3),)):
        simulation = Simulation(with_effects(nominal, *effects))
        state, throttle = equilibrium(simulation, 2, 1466.0)
        t = np.arange(500) * 1e-3
        wave = throttle + 0.005 * np.sin(50 * t)
        inputs = Inputs.held(500, gear=2.0, throttle_command=wave)
        seen.append(simulation.advance(state, inputs)[1].slip)
    assert seen[0] == pytest.approx(seen[1], abs=1e-9)


# Relaxation length


@pytest.mark.parametrize("speed", [15.0, 40.0])
def test_the_force_settles_over_a_length_not_a_time(nominal, speed):
    length = 0.3
    simulation = Simulation(with_effects(nominal, RelaxationLength(length=length)))
    state = simulation.state(speed=speed, rear_speed=1.01 * speed / nominal.rear_wheel.radius)
    x = simulation.states(state)
    dx, out = simulation.instant(x, simulation.row(2, 0.1))
    place = simulation.layout.states.index("relaxation_length.force")
    static = dx[place] * length / speed
    plain = Simulation(nominal)
    _, expected = plain.instant(plain.states(state), plain.row(2, 0.1))
    assert out.tyre_force[0] == 0.0
    assert static == pytest.approx(expected.tyre_force[0])


# Rate limit


def test_the_plate_is_never_faster_than_its_limit(nominal):
    limit = 3.0
    simulation = Simulation(with_effects(nominal, RateLimit(limit=limit)))
    command = np.repeat([0.9, 0.1, 0.6], 400)
    _, out = simulation.advance(
        simulation.state(), Inputs.held(1200, gear=0.0, throttle_command=command)
    )
    velocity = np.diff(out.throttle) / simulation.step
    assert np.abs(velocity).max() <= limit * (1 + 1e-9)
    assert velocity.max() == pytest.approx(limit, rel=1e-6)
    assert out.throttle[-1] == pytest.approx(0.6, abs=1e-4)


# Asymmetric filling


def test_closing_takes_longer_by_the_asymmetry(nominal):
    asymmetry = 0.7
    simulation = Simulation(with_effects(nominal, AsymmetricFilling(asymmetry=asymmetry)))
    row = simulation.row(2, 0.3)
    rates = []
    for air in (0.2, 0.4):
        x = simulation.states(simulation.state(throttle=0.3, air=air))
        rates.append(simulation.instant(x, row)[0][simulation.layout.states.index("air")])
    opening, closing = rates
    assert opening == pytest.approx(0.1 / nominal.intake.filling_time)
    assert -opening / closing == pytest.approx(1 + asymmetry)


# Tooth misplacement


def test_misplaced_teeth_repeat_every_turn_and_add_up_to_a_full_turn(demonstration):
    disc = toothed_disc(demonstration.rear_encoder, demonstration.effects)
    teeth = len(disc.angles)
    speed = 100.0
    t = np.arange(1, 4001) * 0.25e-3
    _, seen = passing_teeth(disc, begin(0.0, 0.0, speed), t, speed * t, np.full(4000, speed))
    gaps = np.diff(seen.ticks)
    assert np.abs(gaps[teeth:] - gaps[:-teeth]).max() <= 1
    turns = seen.ticks[teeth:] - seen.ticks[:-teeth]
    assert np.abs(turns - 2e6 * np.pi / speed).max() <= 1
    late = np.ptp(gaps) / 2 * 1e-6 * speed
    assert late == pytest.approx(3e-3 / 0.1, rel=0.01)


# Optical lag


def test_the_optical_speed_trails_by_lag_times_acceleration(nominal):
    lag = 0.03
    simulation = Simulation(with_effects(nominal, OpticalLag(time_constant=lag)))
    state, throttle = equilibrium(simulation, 2, 1466.0)
    pull = Inputs.held(2000, gear=2.0, throttle_command=throttle + 0.1)
    _, out = simulation.advance(state, pull)
    trail = (out.speed - out.optical_speed) / out.acceleration
    rate = np.gradient(out.optical_speed, out.time)
    assert trail[-1] == pytest.approx(lag, rel=0.02)
    slope = (out.speed - out.optical_speed) / lag
    assert rate[10:-10] == pytest.approx(slope[10:-10], abs=1e-4)

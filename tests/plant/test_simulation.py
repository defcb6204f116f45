"""Laws of the simulation: time, inputs, delays, steps."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.plant.effects.free_curve import free_curve
from slipbench.plant.effects.gear_play import GearPlay
from slipbench.plant.effects.library import LIBRARY
from slipbench.plant.equilibrium import equilibrium
from slipbench.plant.kernel import held_value
from slipbench.plant.motorcycle import BLOCK_NAMES, Motorcycle
from slipbench.plant.signals import Inputs, Outputs
from slipbench.plant.simulation import Simulation

CRANK_SPEED = 1466.0


@pytest.mark.parametrize("name", ["nominal", "demonstration"])
@pytest.mark.parametrize("crank_speed", [400.0, 900.0, CRANK_SPEED])
def test_a_steady_state_stays_for_ten_seconds(name, crank_speed, request):
    simulation = Simulation(request.getfixturevalue(name), every=40, steps_per_row=40)
    state, throttle = equilibrium(simulation, 2, crank_speed)
    _, out = simulation.advance(state, Inputs.held(1000, gear=2.0, throttle_command=throttle))
    assert out.time[-1] == pytest.approx(10.0)
    for column in ("engine_speed", "rear_speed", "speed", "slip", "optical_speed", "tyre_force"):
        values = getattr(out, column)
        assert np.ptp(values) < 1e-7 * (1e-2 + abs(values[0])), column


def test_an_impossible_steady_state_is_refused_with_a_remedy(nominal):
    with pytest.raises(ValueError, match="choose a lower speed or a lower gear"):
        equilibrium(Simulation(nominal), 6, 1600.0)


def test_slip_at_the_operating_point_is_that_of_a_motorcycle(demonstration):
    simulation = Simulation(demonstration)
    state, throttle = equilibrium(simulation, 2, CRANK_SPEED)
    _, out = simulation.advance(state, Inputs.held(1, gear=2.0, throttle_command=throttle))
    assert 0.005 < out.slip[0] < 0.03
    assert 50.0 < out.speed[0] < 56.0


def test_steady_slip_is_pacejkas(nominal):
    simulation = Simulation(nominal)
    state, throttle = equilibrium(simulation, 2, CRANK_SPEED)
    _, out = simulation.advance(state, Inputs.held(1, gear=2.0, throttle_command=throttle))
    tyre, body = nominal.tyre, nominal.body
    peak = tyre.friction * tyre.load
    v = out.speed[0]
    drag = 0.5 * body.air_density * body.drag_area * v**2
    force = drag + body.mass * 9.80665 * body.rolling_resistance
    B = tyre.slip_stiffness / (tyre.shape * peak)
    assert out.slip[0] == pytest.approx(np.tan(np.arcsin(force / peak) / tyre.shape) / B, rel=1e-9)


def errors(out: Outputs, reference: Outputs, columns: tuple[str, ...]) -> np.ndarray:
    return np.array([np.abs(out[c] - reference[c]).max() / np.ptp(reference[c]) for c in columns])


def test_halving_the_step_divides_the_error_by_eight(nominal, swept):
    columns = ("throttle", "air", "engine_speed", "rear_speed", "slip", "tyre_force")
    reference = swept(nominal, 1e-3 / 64)
    coarse, fine = (errors(swept(nominal, h), reference, columns) for h in (0.5e-3, 0.25e-3))
    assert (coarse / fine > 6.5).all()
    assert (fine < 2e-6).all()


def test_the_step_imitates_no_relaxation_length(demonstration, swept):
    """An integration error that looks like a lag of the force counts as a length: under 5 um."""
    out, reference = swept(demonstration), swept(demonstration, 1e-3 / 64)
    slope = np.gradient(reference.tyre_force, reference.time)
    lag = -((out.tyre_force - reference.tyre_force) @ slope) / (slope @ slope)
    assert abs(lag) * reference.speed.mean() < 5e-6


def test_many_calls_give_the_same_bits_as_one(demonstration, swept):
    t = np.arange(400) * 1e-3
    simulation = Simulation(demonstration)
    state, throttle = equilibrium(simulation, 2, CRANK_SPEED)
    wave = throttle + 0.05 * np.sin(40 * t)
    inputs = Inputs.held(400, gear=2.0, throttle_command=wave, spark=0.1 * np.cos(60 * t))
    last, whole = simulation.advance(state, inputs)
    pieces = []
    for row in inputs.table:
        state, out = simulation.advance(state, Inputs(row[None, :].copy()))
        pieces.append(out.table)
    assert (np.concatenate(pieces) == whole.table).all()
    assert (state == last).all()


def test_a_run_does_not_touch_the_state_that_it_was_given(demonstration):
    simulation = Simulation(demonstration)
    state, _ = equilibrium(simulation, 2, CRANK_SPEED)
    before = state.copy()
    first = simulation.advance(state, Inputs.held(50, gear=2.0, throttle_command=0.5))[1]
    second = simulation.advance(state, Inputs.held(50, gear=2.0, throttle_command=0.5))[1]
    assert (state == before).all()
    assert (first.table == second.table).all()


def test_thinned_output_is_every_kth_row(demonstration, swept):
    whole, thin = swept(demonstration, every_ms=False), swept(demonstration)
    assert (whole.table[3::4] == thin.table).all()


@pytest.mark.parametrize("delay", [0.0, 0.1e-3, 1e-3, 4e-3, 4.1e-3, 7.77e-3])
def test_the_servo_answers_a_step_exactly_one_delay_later(nominal, delay):
    bike = replace(nominal, throttle_servo=replace(nominal.throttle_servo, delay=delay))
    simulation = Simulation(bike)
    rest = 0.3
    state = simulation.state(throttle=rest, throttle_command=rest, speed=50.0, rear_speed=156.0)
    inputs = Inputs.held(60, gear=0.0, throttle_command=rest + 0.1)
    _, out = simulation.advance(state, inputs)
    w, z = bike.throttle_servo.natural_frequency, bike.throttle_servo.damping
    t = np.maximum(out.time - delay, 0.0)
    wd = w * np.sqrt(1 - z**2)
    answer = 1 - np.exp(-z * w * t) * (np.cos(wd * t) + z / np.sqrt(1 - z**2) * np.sin(wd * t))
    quiet = out.time <= delay - simulation.step
    assert out.throttle == pytest.approx(rest + 0.1 * answer, abs=2e-7)
    assert (out.throttle[quiet] == rest).all()


@pytest.mark.parametrize("delay", [0.0, 0.15e-3, 0.9e-3, 10e-3, 10.1e-3])
def test_the_air_follows_the_throttle_of_one_delay_ago(nominal, delay):
    """The delayed run's air is the prompt run's air, shifted, between samples as well."""

    def air(d: float) -> np.ndarray:
        bike = replace(nominal, intake=replace(nominal.intake, delay=d))
        simulation = Simulation(bike)
        state = simulation.state(throttle=0.3, air=0.3, throttle_command=0.3)
        t = np.arange(300) * 1e-3
        wave = 0.3 + 0.1 * np.sin(50 * t)
        out = simulation.advance(state, Inputs.held(300, gear=0.0, throttle_command=wave))[1]
        return np.array([out.time, out.air])

    t, prompt = air(0.0)
    seen = air(delay)[1]
    shifted = np.interp(t - delay, t, prompt)
    late = t > 0.05
    error = np.abs(seen - shifted)[late].max()
    assert error < 0.5 * (0.1 * 50**2) * simulation_step() ** 2 / 4 + 1e-6


def simulation_step() -> float:
    return 0.25e-3


@settings(max_examples=50, deadline=None)
@given(delay=st.floats(0, 20), start=st.floats(0, 1), jump=st.floats(-1, 1))
def test_a_delayed_jump_keeps_its_area_and_its_moment(delay, start, jump):
    ring = np.full(64, start)
    step_of_jump = 100
    whole, f = int(delay), delay - int(delay)
    count = step_of_jump + whole
    ring[[(step_of_jump + k) & 63 for k in range(whole + 1)]] = start + jump
    mean, tilt = held_value(ring, count, delay)
    assert mean == pytest.approx(start + (1 - f) * jump)
    assert mean / 2 + tilt / 12 == pytest.approx(start / 2 + jump * (1 - f**2) / 2)


def test_commands_are_held_not_interpolated(nominal):
    simulation = Simulation(nominal, steps_per_row=40)
    state = simulation.state(throttle=0.2, throttle_command=0.2)
    inputs = Inputs.held(2, gear=0.0, throttle_command=np.array([0.2, 0.4]))
    _, out = simulation.advance(state, inputs)
    moved = out.time[out.throttle != 0.2][0]
    assert moved == pytest.approx(10e-3 + 4e-3 + simulation.step)


def test_an_unknown_gear_is_refused(nominal):
    simulation = Simulation(nominal)
    with pytest.raises(ValueError, match=r"1 to 6, and 0 for neutral"):
        simulation.advance(simulation.state(), Inputs.held(1, gear=7.0))
    with pytest.raises(TypeError, match="no input"):
        Inputs.held(1, geer=1.0)


def test_neutral_and_a_pulled_clutch_pass_no_torque(nominal):
    simulation = Simulation(nominal)
    state, throttle = equilibrium(simulation, 2, CRANK_SPEED)
    for released in ({"gear": 0.0}, {"gear": 2.0, "clutch": 0.0}):
        inputs = Inputs.held(50, throttle_command=throttle, **released)
        assert np.abs(simulation.advance(state, inputs)[1].driveline_torque).max() == 0.0


def test_the_clutch_passes_no_more_than_its_capacity(nominal):
    simulation = Simulation(nominal)
    state = simulation.state(engine_speed=1200.0, air=1.0, throttle=1.0, throttle_command=1.0)
    inputs = Inputs.held(3000, gear=1.0, throttle_command=1.0, clutch=0.1)
    _, out = simulation.advance(state, inputs)
    limit = 0.1 * nominal.driveline.clutch_capacity * nominal.gears[0]
    assert out.driveline_torque.max() <= limit
    assert out.driveline_torque[1000] == pytest.approx(limit)
    assert out.speed[-1] > 5.0


def test_disturbances_act_where_they_say(nominal):
    simulation = Simulation(nominal)
    state, throttle = equilibrium(simulation, 2, CRANK_SPEED)
    held = {"gear": 2.0, "throttle_command": throttle}
    calm = simulation.advance(state, Inputs.held(1, **held))[1]
    pushed = simulation.advance(state, Inputs.held(1, **held, road_force=100.0))[1]
    push = (pushed.acceleration - calm.acceleration) * nominal.body.mass
    assert push == pytest.approx(100.0, abs=1.0)
    turned = simulation.advance(state, Inputs.held(1, **held, engine_disturbance=5.0))[1]
    assert turned.engine_torque - calm.engine_torque == pytest.approx(5.0, abs=0.01)
    wet = simulation.advance(state, Inputs.held(200, **held, grip=0.3))[1]
    assert wet.slip.max() > 1.2 * calm.slip[0]
    assert wet.tyre_force.max() <= 0.3 * nominal.tyre.friction * nominal.tyre.load
    crest = simulation.advance(state, Inputs.held(200, **held, load=0.0))[1]
    assert np.abs(crest.tyre_force).max() < 0.01


def recorded(nominal: Motorcycle, **columns: np.ndarray) -> Outputs:
    simulation = Simulation(nominal, every=4)
    state, throttle = equilibrium(simulation, 2, CRANK_SPEED)
    t = np.arange(1500) * 1e-3
    wave = throttle + 0.03 * np.sin(2 * np.pi * (2 + 3 * t) * t)
    return simulation.advance(state, Inputs.held(1500, gear=2.0, throttle_command=wave, **columns))[
        1
    ]


def test_a_measured_signal_takes_the_place_of_its_model(nominal):
    """Driven by its own recording each block gives the same answer, to the interpolation."""
    free = recorded(nominal)
    for name in ("throttle", "engine_speed", "rear_speed", "speed"):
        led = recorded(nominal, **{f"measured_{name}": free[name]})
        assert led[name] == pytest.approx(free[name], rel=1e-12)
        for other in ("air", "rear_speed", "speed", "tyre_force"):
            worst = np.abs(led[other] - free[other]).max() / np.ptp(free[other])
            assert worst < 2e-3, (name, other)


def test_a_measured_signal_shields_what_comes_after_from_what_came_before(nominal):
    free = recorded(nominal)
    slow = replace(nominal, throttle_servo=replace(nominal.throttle_servo, natural_frequency=20.0))
    wrong, led = recorded(slow), recorded(slow, measured_throttle=free.throttle)
    assert (
        np.abs(led.rear_speed - free.rear_speed).max()
        < 1e-2 * np.abs(wrong.rear_speed - free.rear_speed).max()
    )


def test_a_state_or_table_of_another_kind_is_refused(nominal):
    state = Simulation(nominal, step=1e-3).state()
    with pytest.raises(ValueError, match="another step or other effects"):
        Simulation(nominal).advance(state, Inputs.held(1))
    with pytest.raises(ValueError, match=r"make it with Inputs\.held"):
        Inputs(np.zeros((3, 2)))


def extreme(draw: st.DrawFn, block: object) -> object:
    described = type(block).parameters()
    return type(block)(
        **{
            p.name: float(draw(st.sampled_from([p.low, p.typical, min(p.high, 1e6)])))
            for p in described
        }
    )


@st.composite
def motorcycles(draw: st.DrawFn) -> Motorcycle:
    blocks = {name: extreme(draw, getattr(Motorcycle(), name)) for name in BLOCK_NAMES}
    present = draw(st.lists(st.sampled_from(LIBRARY), unique=True))
    return Motorcycle(**blocks, effects=tuple(extreme(draw, effect()) for effect in present))


@settings(max_examples=150, deadline=None)
@given(
    bike=motorcycles(),
    speed=st.sampled_from([-3.0, 0.0, 1e-9, 0.5, 3.0, 20.0, 90.0]),
    engine_speed=st.sampled_from([0.0, 100.0, 1600.0]),
    gear=st.sampled_from([0.0, 1.0, 6.0]),
    brake=st.sampled_from([0.0, 500.0]),
)
def test_nothing_in_the_valid_ranges_leaves_the_finite_numbers(
    bike, speed, engine_speed, gear, brake
):
    simulation = Simulation(bike)
    state = simulation.state(
        speed=speed, engine_speed=engine_speed, rear_speed=speed / bike.rear_wheel.radius
    )
    wave = np.repeat([1.0, 0.0, 0.6], 100)
    inputs = Inputs.held(
        300, gear=gear, throttle_command=wave, spark=0.3, rear_brake=brake, front_brake=brake / 2
    )
    _, out = simulation.advance(state, inputs)
    assert np.isfinite(out.table).all()
    assert (out.throttle >= 0.0).all()
    assert (out.throttle <= 1.0).all()


def test_courses_are_columns_of_all_outputs_and_the_servo_alone_moves_alike() -> None:
    bike = Motorcycle(effects=(GearPlay(play=3e-3),))
    whole = Simulation(bike, 0.5e-3, 2, 2)
    command = 0.1 + 0.03 * np.sin(np.arange(500) * 0.05)
    inputs = Inputs.held(500, gear=2.0, throttle_command=command)
    start = {
        "throttle": 0.1,
        "air": 0.1,
        "engine_speed": 1000.0,
        "rear_speed": 115.0,
        "speed": 36.0,
        "throttle_command": 0.1,
    }
    out = whole.advance(whole.state(**start), inputs)[1]
    some = whole.trajectories(whole.state(**start), inputs, ("throttle", "rear_angle"))
    assert np.array_equal(some["throttle"], out.throttle)
    assert np.array_equal(some["rear_angle"], out.rear_angle)
    servo = Simulation(bike, 0.5e-3, 2, 2, servo_only=True)
    alone = servo.trajectories(servo.state(**start), inputs, ("throttle", "speed"))
    assert np.allclose(alone["throttle"], out.throttle, rtol=0.0, atol=1e-12)
    assert np.ptp(alone["speed"]) == 0.0


def test_a_free_curve_along_the_twist_acts_as_a_stiffer_spring_does() -> None:
    bike = Motorcycle()
    knots = tuple(np.linspace(-0.05, 0.15, 16))
    curve = free_curve(
        "driveline torque", "twist", knots, tuple(0.1 * bike.driveline.stiffness * z for z in knots)
    )
    assert curve is not None
    stiffer = replace(bike.driveline, stiffness=1.1 * bike.driveline.stiffness)
    state, throttle = equilibrium(Simulation(bike, 0.5e-3, 2, 2), 2, 1400.0)
    wave = throttle + 0.03 * np.sin(0.02 * np.arange(1000))
    inputs = Inputs.held(1000, gear=2.0, throttle_command=wave)
    curved, stiff, plain = (
        Simulation(b, 0.5e-3, 2, 2).advance(state, inputs)[1].engine_speed
        for b in (replace(bike, effects=(curve,)), replace(bike, driveline=stiffer), bike)
    )
    assert np.abs(curved - stiff).max() < 1e-9
    assert np.abs(curved - plain).max() > 0.1


def test_a_free_curve_knows_only_what_the_simulation_knows_at_its_place() -> None:
    knots = tuple(np.linspace(0.0, 1.0, 16))
    assert free_curve("servo force", "twist", knots, knots) is None
    assert free_curve("engine torque", "acceleration", knots, knots) is None

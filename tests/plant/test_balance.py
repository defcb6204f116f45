"""Laws of mechanics that the motorcycle must keep, whatever its numbers."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.plant.blocks import Body, RearWheel
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Inputs
from slipbench.plant.simulation import Simulation

GEAR = 2


@settings(max_examples=60, deadline=None)
@given(
    twist=st.floats(-0.3, 0.3),
    engine_speed=st.floats(0, 1700),
    rear_speed=st.floats(-5, 250),
    speed=st.floats(-2, 80),
    air=st.floats(0, 1),
    clutch=st.floats(0, 1),
    brake=st.floats(0, 300),
)
def test_no_power_appears_or_vanishes(twist, engine_speed, rear_speed, speed, air, clutch, brake):
    """What the engine gives is stored in masses and spring, or lost at a named place."""
    bike = Motorcycle()
    simulation = Simulation(bike)
    x = simulation.state(
        twist=twist, engine_speed=engine_speed, rear_speed=rear_speed, speed=speed, air=air
    )[1 : 1 + len(simulation.layout.states)]
    row = simulation.row(GEAR, 0.1)
    row[Inputs.names.index("clutch")] = clutch
    row[Inputs.names.index("front_brake")] = brake
    dx, out = simulation.instant(x, row)
    rate = dict(zip(simulation.layout.states, dx, strict=True))
    ratio = bike.gears[GEAR - 1]
    stored = (
        bike.engine.inertia * engine_speed * rate["engine_speed"]
        + bike.driveline.stiffness * twist * rate["twist"]
        + bike.rear_wheel.inertia * rear_speed * rate["rear_speed"]
        + bike.body.mass * speed * rate["speed"]
    )
    force = float(out.tyre_force[0])
    in_clutch = float(out.driveline_torque[0]) * (engine_speed / ratio - rear_speed - rate["twist"])
    in_spring = bike.driveline.damping * rate["twist"] ** 2
    in_tyre = force * (rear_speed * bike.rear_wheel.radius - speed)
    in_bearings = bike.rear_wheel.rolling_torque * rear_speed * np.clip(rear_speed, -1, 1)
    on_the_way = (force - bike.body.mass * rate["speed"]) * speed
    losses = [in_clutch, in_spring, in_tyre, in_bearings, on_the_way]
    assert min(losses) >= -1e-9
    given_power = float(out.engine_torque[0]) * engine_speed
    scale = 1.0 + abs(given_power) + sum(abs(loss) for loss in losses)
    assert stored == pytest.approx(given_power - sum(losses), abs=1e-10 * scale)


def test_energy_over_a_run_is_what_the_engine_gave_less_the_losses(nominal, swept):
    out = swept(nominal, every_ms=False, spark=0.0)
    w, n = nominal, nominal.gears[GEAR - 1]
    energy = 0.5 * (
        w.engine.inertia * out.engine_speed**2
        + w.driveline.stiffness * out.twist**2
        + w.rear_wheel.inertia * out.rear_speed**2
        + w.body.mass * out.speed**2
    )
    twist_rate = out.engine_speed / n - out.rear_speed
    power = (
        out.engine_torque * out.engine_speed
        - w.driveline.damping * twist_rate**2
        - out.tyre_force * (out.rear_speed * w.rear_wheel.radius - out.speed)
        - w.rear_wheel.rolling_torque * out.rear_speed
        - (out.tyre_force - w.body.mass * out.acceleration) * out.speed
    )
    given_energy = np.trapezoid(power, out.time)
    assert energy[-1] - energy[0] == pytest.approx(given_energy, abs=2e-5 * np.ptp(energy))


def test_coast_down_follows_the_analytic_drag():
    """In neutral, with massless wheels, m v' = -a - b v^2 has v = sqrt(a/b) tan(phi - t ...)."""
    bike = Motorcycle(body=Body(), rear_wheel=RearWheel(inertia=0.2, rolling_torque=0.0))
    simulation = Simulation(bike)
    v0 = 55.0
    state = simulation.state(speed=v0, rear_speed=v0 / bike.rear_wheel.radius)
    _, out = simulation.advance(state, Inputs.held(20_000, gear=0.0))
    wheel = bike.rear_wheel.inertia / bike.rear_wheel.radius**2
    mass = bike.body.mass + wheel
    a = bike.body.mass * 9.80665 * bike.body.rolling_resistance / mass
    b = 0.5 * bike.body.air_density * bike.body.drag_area / mass
    root = math.sqrt(a * b)
    expected = math.sqrt(a / b) * np.tan(math.atan(v0 * math.sqrt(b / a)) - root * out.time)
    assert out.speed == pytest.approx(expected, rel=2e-5)


def test_at_rest_with_the_clutch_pulled_nothing_moves(nominal):
    simulation = Simulation(nominal)
    state = simulation.state()
    _, out = simulation.advance(state, Inputs.held(500, gear=1.0, clutch=0.0))
    assert np.abs(out.speed).max() == 0.0
    assert np.abs(out.rear_speed).max() == 0.0


def test_brakes_stop_the_motorcycle_and_hold_it(nominal):
    simulation = Simulation(nominal)
    state = simulation.state(speed=10.0, rear_speed=10.0 / nominal.rear_wheel.radius)
    brakes = Inputs.held(5000, gear=0.0, front_brake=400.0, rear_brake=100.0)
    _, out = simulation.advance(state, brakes)
    assert out.speed.min() > -1e-3
    assert np.abs(out.speed[-100:]).max() < 1e-3

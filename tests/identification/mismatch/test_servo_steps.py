"""The throttle servo is simulated far more precisely than its sensor measures.

A command that changes between two steps of the simulation acts over a whole step, with its mean. The delay
of the servo is no multiple of a step, so that all edges of a command do.
"""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.mismatch.motorcycle.simulate import SERVO_STEPS, steps_per_row
from slipbench.plant.effects.acceleration_limit import AccelerationLimit
from slipbench.plant.effects.effect import Effect
from slipbench.plant.effects.rate_limit import RateLimit
from slipbench.plant.effects.throttle_stiction import ThrottleStiction
from slipbench.plant.effects.voltage_limit import VoltageLimit
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Inputs
from slipbench.plant.simulation import Simulation

ROW = 1e-3  # s
NOISE = 3e-4
"""White noise of a throttle sensor, share of the full opening."""
SHARE = 0.2
"""Of the noise: an error of this size, if it were in all samples, changes a score by 2 % of a nat each."""
EFFECTS = (
    AccelerationLimit(limit=250.0),
    VoltageLimit(stall_acceleration=300.0, no_load_speed=12.0),
    RateLimit(limit=3.0),
    ThrottleStiction(),
)


def moved(effect: Effect, late: float, steps: int) -> np.ndarray:
    """Opening of the plate after steps and sines of the command, by row. late: s, beyond the delay."""
    servo = Motorcycle().throttle_servo
    bike = Motorcycle(effects=(effect,), throttle_servo=replace(servo, delay=servo.delay + late))
    time = ROW * np.arange(3000)
    command = 0.3 + 0.08 * np.sign(np.sin(2 * np.pi * 1.3 * time)) * (time < 1.5)
    command += 0.05 * np.sin(2 * np.pi * (2.0 + 4.0 * time) * time) * (time >= 1.5)
    alone = Simulation(bike, ROW / steps, steps, steps, servo_only=True)
    state = alone.state(throttle=0.3, throttle_command=0.3)
    inputs = Inputs.held(time.size, gear=2.0, throttle_command=command)
    return alone.trajectories(state, inputs, ("throttle",))["throttle"]


def error(effect: Effect, late: float, steps: int) -> float:
    """Root mean square difference from a simulation with 32 steps a row."""
    return float(np.sqrt(np.mean((moved(effect, late, steps) - moved(effect, late, 32)) ** 2)))


@pytest.mark.parametrize("late", [0.0, 0.3e-3, 0.5e-3, 0.8e-3])
@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_more_steps_would_not_show_in_the_noise(effect, late):
    assert error(effect, late, SERVO_STEPS) < SHARE * NOISE


def test_one_step_a_row_would_show_where_the_acceleration_is_limited():
    assert error(EFFECTS[0], 0.8e-3, 1) > NOISE


def test_the_servo_has_these_steps_in_coarse_and_fine_simulations():
    assert steps_per_row("servo", 1) == steps_per_row("servo", 2) == SERVO_STEPS
    assert steps_per_row("motion", 2) == 2

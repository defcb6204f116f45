"""Laws of dry friction: it sticks at rest, never drives, and is constant far from rest."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.systems.effects.friction import rub
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.recording.from_arrays import recording_of
from tests.identification.mismatch.laws.explained import explained, holds, names, reported

STEP = 1e-3
FORCE, STEADY = 2.0, {"breakaway": 0.0, "stribeck": 0.1}
accelerations, speeds = st.floats(-50.0, 50.0), st.floats(-10.0, 10.0)
breakaways, stribecks = st.floats(0.0, 3.0), st.floats(0.01, 5.0)


def rubbed(a, v, breakaway=0.0, stribeck=0.1):
    return rub(a, v, v, STEP, FORCE, breakaway, stribeck)


@given(share=st.floats(-1.0, 1.0), breakaway=breakaways, stribeck=stribecks)
def test_at_rest_what_is_less_than_the_breakaway_force_moves_nothing(share, breakaway, stribeck):
    pull = share * FORCE * (1.0 + breakaway)
    assert rubbed(pull, 0.0, breakaway, stribeck) == pytest.approx(0.0, abs=1e-12)


@given(a=accelerations, v=speeds, breakaway=breakaways, stribeck=stribecks)
def test_it_takes_energy_and_never_reverses_the_motion(a, v, breakaway, stribeck):
    """The friction force opposes the speed at the end of the step that it produces."""
    net = rubbed(a, v, breakaway, stribeck)
    after = v + STEP * net
    assert (net - a) * after <= 1e-9 * (1.0 + abs(a))
    assert abs(net - a) <= FORCE * (1.0 + breakaway) * (1.0 + 1e-12)
    free = v + STEP * a
    assert abs(after) <= abs(free) + 1e-12
    assert after * free >= -1e-12


@given(a=accelerations, v=speeds)
def test_it_is_odd(a, v):
    assert rubbed(-a, -v, 0.5) == pytest.approx(-rubbed(a, v, 0.5), abs=1e-12)


@given(a=st.floats(-50.0, 50.0), v=st.floats(1.0, 10.0), side=st.sampled_from([1.0, -1.0]))
def test_far_from_rest_it_is_the_same_at_a_rate_and_at_a_seam(a, v, side):
    at_seam = rub(a, side * v, math.nan, STEP, FORCE, 0.5, 0.1)
    assert rubbed(a, side * v, 0.5) == pytest.approx(at_seam, abs=1e-6)
    assert at_seam == pytest.approx(a - side * FORCE, abs=1e-6)


SERVO = """
name = "Servo that holds a load"
step = "2 ms"
period = "10 ms"

[parameters]
stiffness = { value = 900, unit = "1/s^2", plus_minus = 200 }
damping = { value = 30, unit = "1/s", plus_minus = 10 }
weight = { value = 40, unit = "rad/s^2", plus_minus = 10 }

[inputs.goal]
role = "goal"
size = { value = 1, unit = "rad" }

[states.angle]
rate = "speed"
size = { value = 1, unit = "rad" }

[states.speed]
rate = "stiffness * (goal - angle) - weight * sin(angle) - damping * speed"
size = { value = 4, unit = "rad/s" }

[outputs.encoder]
role = "position"
value = "angle"
size = { value = 1, unit = "rad" }
"""
NUMBERS = {"stiffness": 950.0, "damping": 33.0, "weight": 42.0}


def held(seed, force, breakaway):
    """Ride in which the servo moves to positions and holds them; the friction sticks there."""
    rng = np.random.default_rng(seed)
    times = 0.01 * np.arange(900)
    goal = np.repeat(np.concatenate(([0.0], rng.uniform(-1.2, 1.2, 14))), 60)
    goal = np.convolve(np.pad(goal, 20, mode="edge"), np.ones(41) / 41, "valid")
    fine, angle, speed, shown = 1e-4, float(goal[0]), 0.0, []
    for target in goal:
        shown.append(angle)
        for _ in range(100):
            a = NUMBERS["stiffness"] * (target - angle) - NUMBERS["weight"] * math.sin(angle)
            a -= NUMBERS["damping"] * speed
            most = force * (1.0 + breakaway * math.exp(-((speed / 0.15) ** 2)))
            speed += fine * (a - min(max(a + speed / fine, -most), most))
            angle += fine * speed
    position = np.round(np.array(shown) * 4096 / (2 * np.pi)) * 2 * np.pi / 4096
    return recording_of(f"held {seed}", times, {"goal": goal, "position": position}, UNITS)


UNITS = {"goal": "rad", "position": "rad"}
LIBRARY = ("friction", "viscous_friction", "presliding", "hysteresis", "dead_zone", "cubic", "lag")


@pytest.mark.parametrize("breakaway", [0.0, 1.0])
def test_what_sticks_is_named_and_held_out_places_are_simulated(tmp_path, breakaway):
    """Friction that only regularises the sign of the speed creeps where the servo holds."""
    path = tmp_path / "servo.toml"
    path.write_text(SERVO, encoding="utf-8")
    rides = [held(seed, 15.0, breakaway) for seed in (1, 2, 3)]
    found = explained(ModelSystem.load(path), rides[:2], rides[2:], LIBRARY)
    assert names(found) == ["friction.speed_rate/speed"], reported(found)
    assert holds(found, "friction", "force", 15.0, slack=0.05)
    (error,) = found.held_out
    assert error.improved < 0.5 * error.calibrated, reported(found)
    assert error.improved < 4.0 * error.floor, reported(found)

"""A system without inputs: a pendulum that is released and comes to rest."""

from pathlib import Path

import numpy as np
import pytest
from numba import njit

from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source
from tests.identification.mismatch.laws.explained import explained, holds, names, reported

PERIOD, SECONDS, FINER = 0.01, 20.0, 50
STIFFNESS, DAMPING, FRICTION = 24.0, 0.06, 0.35  # 1/s^2, 1/s, rad/s^2
NOISE = 2e-3  # rad
RELEASED = (1.0, -0.7, 0.45)  # rad
LIBRARY = ("friction", "viscous_friction", "quadratic_drag", "cubic", "scale", "lag", "offset")
MODEL = """
name = "Pendulum"
step = "5 ms"
period = "10 ms"

[parameters]
stiffness = { value = 25, unit = "1/s^2", plus_minus = 2 }
damping = { value = 0.08, unit = "1/s", plus_minus = 0.05 }

[states.angle]
rate = "speed"
size = { value = 30, unit = "deg" }
start = "encoder"
first = { value = 1, unit = "deg" }

[states.speed]
rate = "pull - damping * speed"
size = { value = 2, unit = "rad/s" }
first = { value = 0.1, unit = "rad/s" }

[seams.pull]
value = "-stiffness * sin(angle)"
size = { value = 12, unit = "rad/s^2" }
along = "speed"

[outputs.encoder]
role = "encoder"
value = "angle"
size = { value = 30, unit = "deg" }
"""
ROLES = RoleMap(
    title="x", quantities={"encoder": "rad"}, roles={"encoder": Source(column="encoder")}
)


@njit(cache=True)
def swung(samples, released, friction):
    """Angle at each sample, by small semi-implicit steps, friction smooth within 1 mrad/s."""
    shown, angle, speed = np.zeros(samples), released, 0.0
    h = PERIOD / FINER
    for n in range(samples):
        shown[n] = angle
        for _ in range(FINER):
            speed += h * (-STIFFNESS * np.sin(angle) - DAMPING * speed)
            loss = h * friction
            speed = np.sign(speed) * max(abs(speed) - loss, 0.0)
            angle += h * speed
    return shown


def recorded(friction):
    rng = np.random.default_rng(7)
    time = PERIOD * np.arange(round(SECONDS / PERIOD))
    for number, released in enumerate(RELEASED):
        reading = swung(time.size, released, friction) + NOISE * rng.normal(size=time.size)
        channel = Channel("encoder", time, reading, "rad", "bus", "made")
        yield Recording(Path(f"run{number}"), {}, None, ROLES, {"encoder": channel}, {})


@pytest.fixture(scope="module")
def system(tmp_path_factory):
    path = tmp_path_factory.mktemp("pendulum") / "pendulum.toml"
    path.write_text(MODEL)
    return ModelSystem.load(path)


def test_dry_friction_is_named_with_its_size(system):
    *training, held_out = recorded(FRICTION)
    verdict = explained(system, training, [held_out], LIBRARY)
    print(reported(verdict))
    # What acts on the pull acts on the rate of the speed: one physics, two places of the file.
    places = (["friction.pull/speed"], ["friction.speed_rate/speed"])
    assert names(verdict) in places, reported(verdict)
    assert holds(verdict, "friction", "force", FRICTION)


def test_nothing_is_found_where_nothing_is_missing(system):
    *training, held_out = recorded(0.0)
    verdict = explained(system, training, [held_out], LIBRARY)
    print(reported(verdict))
    assert not verdict.mismatch, reported(verdict)

"""An effect hidden at one of three carts is named there: vector elements are separate places.

The recordings come from an independent integrator, which works on vectors, not on elements.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.plant.signals import Floats
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source
from tests.identification.mismatch.laws.explained import explained, holds, names, reported
from tests.paths import MODELS

PERIOD, FINER = 0.01, 10  # s, steps of the integrator in a period
NOISE = 2e-4  # m
MASS = np.array([1.0, 1.1, 0.85])  # kg
STIFFNESS = np.array([125.0, 85.0, 63.0])  # N/m
LOSS = np.array([2.2, 0.4, 0.6])  # N s/m
JOINS = np.array([[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]])
FRICTION, GAP = 0.6, 0.02  # N, m
QUANTITIES = {"motor_voltage": "V", **{f"place_{k}": "m" for k in (1, 2, 3)}}
ROLES = RoleMap(
    title="carts", quantities=QUANTITIES, roles={r: Source(column=r) for r in QUANTITIES}
)
LIBRARY = ("friction", "viscous_friction", "dead_zone", "cubic", "offset", "saturation")
Law = Callable[[Floats], Floats]


def no_force(speed: Floats) -> Floats:
    return 0.0 * speed


def linear(extension: Floats) -> Floats:
    return extension


def dry_at_the_third(speed: Floats) -> Floats:
    return np.array([0.0, 0.0, FRICTION * np.tanh(speed[2] / 0.005)])


def play_in_the_second(extension: Floats) -> Floats:
    inside = np.clip(extension[1], -GAP, GAP)
    return extension - np.array([0.0, inside, 0.0])


def recorded(seed: int, friction: Law = no_force, acting: Law = linear) -> Recording:
    """Record 8 s. friction: force by the speeds; acting: extension that sets spring force."""
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    time = PERIOD * np.arange(800)
    motor = 10.0 * np.repeat(rng.standard_normal(time.size // 10), 10)

    def rate(x: Floats, force: float) -> Floats:
        place, speed = x[:3], x[3:]
        pull = JOINS.T @ (STIFFNESS * acting(JOINS @ place))
        total = np.array([force, 0.0, 0.0]) - pull - LOSS * speed - friction(speed)
        return np.concatenate((speed, total / MASS))

    x, shown, h = np.zeros(6), np.empty((time.size, 3)), PERIOD / FINER
    for k, force in enumerate(motor):
        shown[k] = x[:3]
        for _ in range(FINER):
            half = x + 0.5 * h * rate(x, force)
            x = x + h * rate(half, force)
    shown += NOISE * rng.standard_normal(shown.shape)
    values = dict(zip(QUANTITIES, (motor, *shown.T), strict=True))
    channels = {r: Channel(r, time, y, ROLES.unit(r), "bus", "made") for r, y in values.items()}
    return Recording(Path(f"carts{seed}"), {}, None, ROLES, channels, {})


@pytest.fixture(scope="module")
def carts() -> ModelSystem:
    return ModelSystem.load(MODELS / "three_carts.toml")


def test_friction_is_named_at_the_cart_that_has_it(carts) -> None:
    rides = [recorded(seed, friction=dry_at_the_third) for seed in (1, 2)]
    found = explained(carts, rides[:1], rides[1:], LIBRARY)
    assert names(found) == ["friction.speed_3_rate/speed_3"], reported(found)
    assert holds(found, "friction", "force", FRICTION / MASS[2])


def test_play_is_named_in_the_spring_that_has_it(carts) -> None:
    rides = [recorded(seed, acting=play_in_the_second) for seed in (3, 4)]
    found = explained(carts, rides[:1], rides[1:], LIBRARY)
    assert names(found) == ["dead_zone.stretch_2"], reported(found)
    assert holds(found, "dead_zone", "width", GAP)


def test_nothing_is_named_where_nothing_is_hidden(carts) -> None:
    found = explained(carts, [recorded(5)], [recorded(6)], LIBRARY)
    assert names(found) == [], reported(found)

"""Physics that every machine may have, hidden in a servo with a pendulum: named, and its size told.

The recordings are made by an integrator of their own (laws/servo.py). Each effect is looked for
beside all that its page says it is confused with and what they are confused with in turn.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from slipbench.identification.mismatch.systems.effects.library import BY_NAME
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.identification.mismatch.telling.verdict import Verdict
from tests.identification.mismatch.laws.explained import explained, holds, names, reported
from tests.identification.mismatch.laws.servo import nothing, servo, turned

CREEP = 0.02  # rad/s
OLD = ("friction", "saturation", "dead_zone", "lag", "asymmetry", "offset", "cubic")


def turns(speed: float) -> float:
    """Direction of motion, smooth within the creep."""
    return math.tanh(speed / CREEP)


def dahl(force: float, distance: float) -> Callable[[float, float, float, float], float]:
    """Dry friction that the angle since the last reversal builds up, for one run."""
    bent, before = 0.0, 0.0

    def torque(nominal: float, speed: float, angle: float, load: float) -> float:
        nonlocal bent, before
        way = angle - before
        bent += way / distance * (1.0 - bent * math.copysign(1.0, way))
        before = angle
        return nominal - force * bent

    return torque


@dataclass(frozen=True)
class Hidden:
    """What is hidden, the effect that names it and its size. how: arguments of a ride."""

    name: str
    parameter: str
    size: float
    how: Callable[[], dict[str, Any]] = field(repr=False)

    def __str__(self) -> str:
        return self.name


def torque(f: Callable[[float, float, float, float], float]) -> Callable[[], dict[str, Any]]:
    """A ride with another torque."""
    return lambda: {"torque": f}


HIDDEN = [
    Hidden("friction", "force", 1.0, torque(lambda f, v, a, z: f - turns(v))),
    Hidden("quadratic_drag", "coefficient", 0.5, torque(lambda f, v, a, z: f - 0.5 * v * abs(v))),
    Hidden("load_friction", "share", 0.2, torque(lambda f, v, a, z: f - 0.2 * abs(f) * turns(v))),
    Hidden(
        "back_drive_loss",
        "share",
        0.4,
        torque(lambda f, v, a, z: f - (0.4 * abs(f) * turns(v) if f * v < 0.0 else 0.0)),
    ),
    Hidden(
        "friction_by_direction", "difference", 1.0, torque(lambda f, v, a, z: f - abs(turns(v)))
    ),
    Hidden("presliding", "force", 1.5, lambda: {"torque": dahl(1.5, 0.1)}),
    Hidden(
        "supply_limit",
        "limit",
        12.0,
        torque(
            lambda f, v, a, z: min(max(f, -12 * max(1 + v / 4, 0.02)), 12 * max(1 - v / 4, 0.02))
        ),
    ),
    Hidden("cogging", "amplitude", 1.0, torque(lambda f, v, a, z: f + math.sin(12 * a + 0.7))),
    Hidden("leak_from_channel", "share", 1.0, torque(lambda f, v, a, z: f + z)),
    Hidden(
        "square_law", "share", 0.4, lambda: {"felt": lambda u: 0.6 * u + 0.4 * u * np.abs(u) / 0.6}
    ),
]


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> ModelSystem:
    return servo(tmp_path_factory.mktemp("servo"))


def family(name: str) -> tuple[str, ...]:
    """An effect, its confusions and theirs, and the old ones of every family."""
    near = {name, *BY_NAME[name].confused_with}
    return tuple(sorted(near | {n for k in near for n in BY_NAME[k].confused_with} | set(OLD)))


def analysed(
    machine: ModelSystem, how: Callable[[], dict[str, Any]], library: tuple[str, ...]
) -> Verdict:
    rides = [turned(seed, **how()) for seed in (1, 2, 3)]
    there = {k.name for k in machine.library}
    return explained(machine, rides[:2], rides[2:], [n for n in library if n in there])


@pytest.mark.parametrize("hidden", HIDDEN, ids=str)
def test_it_is_named_and_its_size_told(machine: ModelSystem, hidden: Hidden) -> None:
    found = analysed(machine, hidden.how, family(hidden.name))
    print(reported(found))
    assert [n.partition(".")[0] for n in names(found)] == [hidden.name], reported(found)
    assert holds(found, hidden.name, hidden.parameter, hidden.size, slack=0.05), reported(found)
    assert found.held_out[0].improved < 1.1 * found.held_out[0].floor


def test_back_emf_is_named_or_listed_with_what_is_the_same(machine: ModelSystem) -> None:
    """Where the drive acts in proportion, viscous friction is the same force."""
    found = analysed(machine, lambda: {"emf": 0.2}, family("back_emf"))
    alike = {n.partition(".")[0] for one in found.equivalents for n in one}
    named = {n.partition(".")[0] for n in names(found)}
    assert named <= {"back_emf", "viscous_friction", "linear_loss"}, reported(found)
    assert {"back_emf", "viscous_friction"} <= alike | named, reported(found)


@pytest.mark.parametrize("seed", [4, 14])
def test_where_nothing_is_hidden_nothing_of_all_is_named(machine: ModelSystem, seed: int) -> None:
    rides = [turned(s, nothing) for s in range(seed, seed + 3)]
    found = explained(machine, rides[:2], rides[2:])
    assert not found.mismatch, reported(found)
    assert not found.effects, reported(found)

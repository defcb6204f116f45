"""Effects common to machines, hidden in a servo with a pendulum: named with magnitude.

The recordings come from an independent integrator (laws/servo.py). Each effect competes with
the effects that its page lists as confusions, and with their confusions in turn.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

from slipbench.identification.mismatch.reporting.verdict import Verdict
from slipbench.identification.mismatch.systems.effects.library import BY_NAME
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.recording.recording import Recording
from tests.identification.mismatch.laws.explained import explained, holds, names, reported
from tests.identification.mismatch.laws.servo import FINER, MODEL, PERIOD, nothing, servo, turned

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


STEP = PERIOD / FINER  # s


FOLLOWED = 640
"""Steps a period of a ride whose torque follows another: it is late by part of a step."""


def slow_to_turn(jerk: float) -> Callable[[float, float, float, float], float]:
    """Acceleration that changes by no more than this a second, for one run; called twice a step."""
    before: float | None = None

    def torque(nominal: float, speed: float, angle: float, load: float) -> float:
        nonlocal before
        most = 0.5 * PERIOD / FOLLOWED * jerk
        if before is None or abs(nominal - before) <= most:
            before = nominal
            return nominal
        now = before
        before += math.copysign(most, nominal - now)
        return now

    return torque


def behind_a_gap(share: float, frequency: float, damping: float, gap: float) -> Any:
    """Part of the inertia on a spring behind a gap, for one run; called twice a step."""
    d, v = 0.0, 0.0

    def torque(nominal: float, speed: float, angle: float, load: float) -> float:
        nonlocal d, v
        wound = 0.0 if abs(d) <= gap else d - math.copysign(gap, d)
        pull = frequency**2 * wound + (2.0 * damping * frequency * v if wound else 0.0)
        driven = (nominal + share * pull) / (1.0 - share)
        v -= 0.5 * STEP * (pull + driven)
        d += 0.5 * STEP * v
        return driven

    return torque


def stopped(limit: float, frequency: float = 50.0) -> Callable[[float, float, float, float], float]:
    """Ends of the travel, as stiff as half of the model's step allows."""

    def torque(nominal: float, speed: float, angle: float, load: float) -> float:
        deep = abs(angle) - limit
        side = math.copysign(1.0, angle)
        contact_force = frequency * (frequency * deep + 0.6 * side * speed)
        return nominal - (side * max(contact_force, 0.0) if deep > 0.0 else 0.0)

    return torque


def followed(rule: Callable[[float, float], float]) -> Callable[[np.ndarray], np.ndarray]:
    """A drive that follows the command. rule: its rate, from remaining error and last rate."""

    def felt(command: np.ndarray) -> np.ndarray:
        place, rate, out = float(command[0]), 0.0, np.empty(command.size)
        for k, value in enumerate(command):
            rate = rule(float(value) - place, rate)
            out[k] = place + 0.5 * STEP * rate  # the mean of the step
            place += STEP * rate
        return out

    return felt


def braked(deceleration: float) -> Callable[[float, float], float]:
    """Rate of the square-root law, by the midpoint rule."""

    def rule(remaining: float, _: float) -> float:
        way = abs(remaining)
        middle = max(way - 0.5 * STEP * math.sqrt(2.0 * deceleration * way), 0.0)
        return math.copysign(min(math.sqrt(2.0 * deceleration * middle), way / STEP), remaining)

    return rule


def slewed(limit: float) -> Callable[[float, float], float]:
    """Rate of a drive that is limited, V/s."""
    return lambda remaining, _: min(max(remaining / STEP, -limit), limit)


def tired(loss: float, time_constant: float, power: int) -> Callable[[np.ndarray], np.ndarray]:
    """A drive that gives less after work. power: 1, of the amount; 2, of its square."""

    def felt(command: np.ndarray) -> np.ndarray:
        state, out = 0.0, np.empty(command.size)
        for k, value in enumerate(command):
            out[k] = value * (1.0 - loss * state)
            state += STEP / time_constant * (abs(value) ** power - state)
        return out

    return felt


@dataclass(frozen=True)
class Hidden:
    """A hidden effect, its name in the library and its magnitude. how: arguments of a ride."""

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
    Hidden("unbalance", "amplitude", 3.0, torque(lambda f, v, a, z: f + 3 * math.sin(a + 1.2))),
    Hidden(
        "elastic_backlash", "share", 0.4, lambda: {"torque": behind_a_gap(0.4, 40.0, 0.1, 0.005)}
    ),
    Hidden("hard_stop", "limit", 0.6, lambda: {"torque": stopped(0.6)}),
    Hidden("supply_sag", "sag", 0.5, lambda: {"felt": tired(0.5, 0.3, 1)}),
    Hidden("thermal_gain", "loss", 0.6, lambda: {"felt": tired(0.6, 4.0, 2)}),
    Hidden("choked_flow", "limit", 0.7, lambda: {"felt": lambda u: np.minimum(u, 0.7)}),
    Hidden("leak_from_channel", "share", 1.0, torque(lambda f, v, a, z: f + z)),
    Hidden(
        "square_law", "share", 0.4, lambda: {"felt": lambda u: 0.6 * u + 0.4 * u * np.abs(u) / 0.6}
    ),
]


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> ModelSystem:
    return servo(tmp_path_factory.mktemp("servo"))


@pytest.fixture(scope="module")
def commanded(tmp_path_factory: pytest.TempPathFactory) -> ModelSystem:
    """The same servo with its command in angles."""
    text = MODEL.replace("rad/s^2/V", "1/s^2").replace('unit = "V"', 'unit = "rad"')
    return servo(tmp_path_factory.mktemp("commanded"), text)


def family(name: str) -> tuple[str, ...]:
    """An effect, its confusions and theirs, and the old ones of every family."""
    near = {name, *BY_NAME[name].confused_with}
    return tuple(sorted(near | {n for k in near for n in BY_NAME[k].confused_with} | set(OLD)))


def in_units(recording: Recording, machine: ModelSystem) -> Recording:
    """The recording in the units of a model file: commands in angles, or a tachometer."""
    parts = (machine.file.inputs, machine.file.outputs)
    units = {name: role.size.si_unit for part in parts for name, role in part.items()}
    channels = {n: replace(c, unit=units[n]) for n, c in recording.channels.items()}
    return replace(recording, channels=channels)


def analysed(
    machine: ModelSystem, how: Callable[[], dict[str, Any]], library: tuple[str, ...]
) -> Verdict:
    rides = [in_units(turned(seed, **how()), machine) for seed in (1, 2, 3)]
    there = {k.name for k in machine.library}
    return explained(machine, rides[:2], rides[2:], [n for n in library if n in there])


@pytest.mark.parametrize("hidden", HIDDEN, ids=str)
def test_it_is_named_and_its_size_told(machine: ModelSystem, hidden: Hidden) -> None:
    found = analysed(machine, hidden.how, family(hidden.name))
    print(reported(found))
    assert [n.partition(".")[0] for n in names(found)] == [hidden.name], reported(found)
    if not ties_before_the_gain(found, hidden.name):
        assert holds(found, hidden.name, hidden.parameter, hidden.size, slack=0.05), reported(found)
    error = found.held_out[0]
    assert error.improved < max(1.1 * error.floor, 0.02 * error.nominal), reported(found)


def ties_before_the_gain(found: Verdict, name: str) -> bool:
    """Whether the leading effect acts before the gain and is listed with its twin at the torque.

    Its size is then in the unit of the drive.
    """
    lead = names(found)[0]
    behind = lead.replace(".drive", ".torque")
    return behind != lead and any(
        {lead, behind} <= set(equivalent) for equivalent in found.equivalents
    )


def test_a_braking_loop_is_named_alone(commanded: ModelSystem) -> None:
    """Of a servo that is commanded in angles: such a loop acts on a position."""
    found = analysed(commanded, lambda: {"felt": followed(braked(100.0))}, family("braking_loop"))
    assert names(found) == ["braking_loop.drive"], reported(found)
    assert holds(found, "braking_loop", "deceleration", 100.0, slack=0.05), reported(found)


def test_a_jerk_limit_is_named_alone(machine: ModelSystem) -> None:
    """The torque of this servo is the rate of its speed: its rate limit is the same."""
    found = analysed(
        machine, lambda: {"torque": slow_to_turn(200.0), "finer": FOLLOWED}, family("jerk_limit")
    )
    (named,) = names(found)
    assert named in {"jerk_limit.speed_rate", "rate_limit.torque"}, reported(found)
    limit, period = (p.value for p in found.effects[0].parameters)
    assert limit / period == pytest.approx(200.0, rel=0.03), reported(found)


def test_a_rate_limit_is_named_alone(machine: ModelSystem) -> None:
    found = analysed(machine, lambda: {"felt": followed(slewed(6.0))}, family("rate_limit"))
    assert names(found) == ["rate_limit.drive"], reported(found)
    limit, period = (p.value for p in found.effects[0].parameters)
    assert limit / period == pytest.approx(6.0, rel=0.03), reported(found)


ALIKE = [
    (lambda: {"emf": 0.2}, {"back_emf", "viscous_friction", "linear_loss"}),
    (torque(lambda f, v, a, z: min(max(f, -10), 10)), {"acceleration_limit", "saturation"}),
]


@pytest.mark.parametrize(("how", "same"), ALIKE, ids=["back_emf", "acceleration"])
def test_what_is_one_force_in_this_servo_is_listed_together(
    machine: ModelSystem, how: Callable[[], dict[str, Any]], same: set[str]
) -> None:
    """Its torque is the rate of its speed, and its drive acts in proportion."""
    library = {n for name in same for n in family(name)}
    found = analysed(machine, how, tuple(sorted(library)))
    indistinguishable = {n.partition(".")[0] for one in found.equivalents for n in one}
    named = {n.partition(".")[0] for n in names(found)}
    assert len(named) == 1, reported(found)
    assert named <= same, reported(found)
    assert same <= indistinguishable | named, reported(found)


@pytest.mark.parametrize("seed", [4, 14])
def test_where_nothing_is_hidden_nothing_of_all_is_named(machine: ModelSystem, seed: int) -> None:
    rides = [turned(s, nothing) for s in range(seed, seed + 3)]
    found = explained(machine, rides[:2], rides[2:])
    assert not found.mismatch, reported(found)
    assert not found.effects, reported(found)

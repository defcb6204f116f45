"""A state never leaves its stops and rebounds by its restitution; so do its sensitivities."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import integrate

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.fit.sensitivity import sensitivities
from slipbench.identification.mismatch.simulation.model import models
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sampling import Grid
from slipbench.identification.mismatch.systems.equations import equations
from slipbench.identification.mismatch.systems.model_file import ModelFile, load_model_file
from slipbench.identification.mismatch.systems.run import SimulatedColumns, run
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.identification.mismatch.systems.unit_check import unit_faults
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source

ROW, ROWS = 0.01, 400
G, DROP, FLOOR, BACK = 9.81, 1.0, 0.2, 0.8
SLOW = 0.02  # m/s, threshold of rest at the floor
BALL = """
name = "Ball above a floor"
step = "5 ms"
period = "10 ms"
stretch = "1 s"

[parameters]
gravity = { value = 9.81, unit = "m/s^2" }
loss = { value = 0, unit = "1/s", plus_minus = 0 }
floor = { value = 0.2, unit = "m" }
back = { value = 0.8, unit = "1", plus_minus = 0.3 }

[inputs.lift]
role = "lift"
size = { value = 10, unit = "m/s^2" }

[states.height]
rate = "speed"
size = { value = 1, unit = "m" }
start = { value = 1.2, unit = "m" }
low = "floor"
restitution = "back"

[states.speed]
rate = "lift - gravity - loss * speed"
size = { value = 3, unit = "m/s" }

[outputs.place]
role = "place"
value = "height"
size = { value = 1, unit = "m" }
"""
TANK = """
name = "Tank"
step = "5 ms"
period = "10 ms"

[inputs.flow]
role = "flow"
size = { value = 1, unit = "m/s" }

[states.level]
rate = "flow"
size = { value = 1, unit = "m" }
start = { value = 0.5, unit = "m" }
low = { value = 20, unit = "cm" }
high = { value = 1, unit = "m" }

[outputs.place]
role = "place"
value = "level"
size = { value = 1, unit = "m" }
"""


def shown(text: str, inputs: Floats, step: float = 5e-3, **values: float) -> SimulatedColumns:
    """Run a model file for rows of an input. values: of parameters, SI."""
    tree: dict[str, Any] = tomllib.loads(text)
    file = ModelFile.model_validate({**tree, "step": step})
    read = equations(file, "test")
    numbers = np.array([values.get(name, n.si) for name, n in file.parameters.items()])
    grid = Grid(len(inputs), 0.0, len(inputs), ROW, ROW)
    record = Record("test", 0.0, grid, inputs[:, None], {}, {}, np.zeros((len(inputs), 0)))
    return run(read, file, numbers, (), record, np.zeros((len(inputs), len(read.places))))


def dropped(t: Floats, gravity: float = G, floor: float = FLOOR, back: float = BACK) -> Floats:
    """Height of a ball dropped from 1.2 m, by the formulas of free flight, m."""
    drop = DROP + FLOOR - floor
    first = np.sqrt(2.0 * drop / gravity)
    height = floor + drop - 0.5 * gravity * t**2
    begun, speed = first, back * gravity * first
    while begun < t[-1] and speed > SLOW:
        flight = t - begun
        height = np.where(t >= begun, floor + speed * flight - 0.5 * gravity * flight**2, height)
        begun, speed = begun + 2.0 * speed / gravity, back * speed
    return np.where(t >= begun, floor, height)


TIME = ROW * np.arange(1, ROWS + 1)
STILL = np.zeros(ROWS)
PUSHES = np.repeat(np.random.default_rng(8).uniform(-40.0, 40.0, ROWS // 10), 10)


@pytest.mark.parametrize("back", [1.0, 0.8, 0.5])
def test_a_bouncing_ball_keeps_the_energy_that_its_restitution_says(back: float) -> None:
    found = shown(BALL, STILL, back=back)
    expected = dropped(TIME, back=back)
    assert np.abs(found["height"] - expected).max() < (1e-6 if back > 0.6 else 1e-3)
    energy = 0.5 * found["speed"] ** 2 + G * (found["height"] - FLOOR)
    levels = np.unique(np.round(energy / (G * DROP), 6))
    shares = np.round(back ** (2.0 * np.arange(20)), 6)
    assert np.isin(levels, shares)[levels > 0.02].all()


@pytest.mark.parametrize("back", [0.0, 0.6, 1.0])
@pytest.mark.parametrize("step", [5e-3, 1e-3])
def test_a_state_never_leaves_its_stops(back: float, step: float) -> None:
    both = BALL.replace('low = "floor"', 'low = "floor"\nhigh = { value = 1.3, unit = "m" }')
    height = shown(both, PUSHES, step, back=back)["height"]
    assert height.min() >= FLOOR
    assert height.max() <= 1.3
    assert (height == FLOOR).any() or back == 1.0


def by_events(lifts: Floats, back: float, loss: float) -> Floats:
    """Height at the end of each row, m: every contact located by an event of scipy.

    A speed below SLOW at the floor is rest.
    """

    def rate(t: float, x: Floats, u: float) -> list[float]:
        return [x[1], u - G - loss * x[1]]

    def floor(t: float, x: Floats, u: float) -> float:
        return float(x[0] - FLOOR)

    floor.terminal, floor.direction = True, -1.0  # type: ignore[attr-defined]
    x, heights = np.array([1.2, 0.0]), []
    for u in lifts:
        t = 0.0 if u > G or x[0] > FLOOR + 1e-9 or x[1] > 0.0 else ROW
        while t < ROW:
            done = integrate.solve_ivp(
                rate, (t, ROW), x, args=(u,), events=floor, rtol=1e-10, atol=1e-12
            )
            t, x = done.t[-1], done.y[:, -1]
            if done.status == 1:
                x = np.array([FLOOR + 1e-12, -back * x[1]])
                if x[1] < SLOW and u < G:
                    x[1] = 0.0
                    break
        heights.append(x[0])
    return np.array(heights)


def test_contacts_are_those_of_an_event_solver() -> None:
    lifts = 0.3 * PUSHES[:150] + 5.0
    expected = by_events(lifts, BACK, 3.0)
    assert np.sum(np.diff(np.sign(np.diff(expected))) > 0) >= 3  # contacts
    found = shown(BALL, lifts, back=BACK, loss=3.0)["height"]
    assert np.abs(found - expected).max() < 1e-5


@pytest.mark.parametrize(("name", "value"), [("back", BACK), ("gravity", G), ("floor", FLOOR)])
def test_away_from_contacts_slopes_are_those_of_free_flight(name: str, value: float) -> None:
    """After eight contacts: difference steps of 1e-7 and 1e-4 of a parameter, and the formulas."""
    away = np.abs(shown(BALL, STILL)["height"] - FLOOR) > 0.01
    for share in (1e-7, 1e-4):
        there, back = (value * (1.0 + s * share) for s in (1.0, -1.0))
        step = there - back
        ours = shown(BALL, STILL, **{name: there})["height"]
        ours = (ours - shown(BALL, STILL, **{name: back})["height"]) / step
        exact = (dropped(TIME, **{name: there}) - dropped(TIME, **{name: back})) / step
        part = away & (TIME < 2.5)
        assert np.isfinite(ours).all()
        assert np.abs(ours - exact)[part].max() < 1e-3 * np.abs(exact[part]).max()


def test_a_ball_that_does_not_come_back_rests_until_it_is_lifted() -> None:
    lift = np.where(TIME < 2.0, 0.0, G + 2.0)
    found = shown(BALL, lift, back=0.0)
    resting = (TIME > 0.46) & (lift == 0.0)
    assert (found["height"][resting] == FLOOR).all()
    assert (found["speed"][resting] == 0.0).all()
    flight = TIME[lift > 0.0] - TIME[resting][-1]
    assert np.allclose(found["height"][lift > 0.0] - FLOOR, flight**2, atol=1e-9)


def test_a_level_stays_at_its_limit_until_its_rate_leads_back() -> None:
    flow = np.where(TIME < 1.0, 2.0, -0.5)
    level = shown(TANK, flow)["level"]
    expected = np.maximum(np.minimum(0.5 + 2.0 * TIME, 1.0), 0.2)
    late = TIME[flow < 0.0][0] - ROW < TIME
    begun = TIME[flow < 0.0][0] - ROW
    expected[late] = np.maximum(1.0 - 0.5 * (TIME[late] - begun), 0.2)
    assert np.allclose(level, expected, atol=1e-12)


def test_a_stop_out_of_reach_changes_nothing() -> None:
    free = BALL.replace('low = "floor"\nrestitution = "back"\n', "")
    far = BALL.replace('low = "floor"', "low = { value = -1e6, unit = 'm' }")
    assert np.array_equal(shown(far, PUSHES)["height"], shown(free, PUSHES)["height"])


def test_a_stop_and_a_delay_act_together() -> None:
    late = BALL.replace("lift - gravity", "delay(lift, 0.02) - gravity")
    later = np.concatenate((PUSHES[:1], PUSHES[:1], PUSHES[:-2]))
    found, expected = (shown(t, u)["height"] for t, u in ((late, PUSHES), (BALL, later)))
    assert np.allclose(found[:150], expected[:150], atol=1e-6)


ROLES = RoleMap(
    title="ball",
    quantities={"lift": "m/s^2", "place": "m"},
    roles={r: Source(column=r) for r in ("lift", "place")},
)


def recorded(seed: int, back: float) -> Recording:
    """Record a ball in oil that is thrown every 2 s, when it rests again; noise of 1 mm.

    A ball that is thrown while it bounces is chaotic: no search finds its restitution.
    """
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    lifts = np.zeros((5, 2 * ROWS // 4))
    lifts[:, 180:] = rng.uniform(20.0, 30.0, (5, 1))
    place = by_events(lifts.ravel(), back, 3.0) + 1e-3 * rng.standard_normal(lifts.size)
    ends = ROW * np.arange(1, lifts.size + 1)
    values = {"lift": (ends - ROW, lifts.ravel()), "place": (ends, place)}
    channels = {r: Channel(r, t, y, ROLES.unit(r), "bus", "made") for r, (t, y) in values.items()}
    return Recording(Path(f"ball{seed}"), {}, None, ROLES, channels, {})


def system(folder, text: str = BALL) -> ModelSystem:
    path = folder / "ball.toml"
    path.write_text(text, encoding="utf-8")
    return ModelSystem.load(path)


@pytest.mark.parametrize("seed", [3, 4])
def test_a_hidden_restitution_is_recovered_with_finite_slopes(tmp_path, seed: int) -> None:
    hidden = 0.65
    damped = BALL.replace("loss = { value = 0", "loss = { value = 3")
    ball = system(tmp_path, damped)
    (model,) = models(ball, [ball.prepare(recorded(seed, hidden))])
    assert all(np.isfinite(b).all() for bs in sensitivities(model, model.origin()) for b in bs)
    analysis = begin(ball, list(model.records), [])
    fit = calibrate(analysis.training, analysis.training.origin())
    places = zip(fit.model.known, fit.point.x, strict=True)
    (found,) = (c.at(float(x)) for c, x in places if c.name == "back")
    print(found)
    assert found == pytest.approx(hidden, abs=0.01)


def test_a_search_keeps_a_restitution_from_0_to_1(tmp_path) -> None:
    ball = system(tmp_path)
    (known,) = (c for c in ball.coordinates([], None) if c.name == "back")
    there = ball.at([known], np.array([9.0]), ())
    assert there.values[there.equations.parameters.index("back")] == 1.0


def test_stops_that_pass_each_other_in_a_search_are_refused_in_words() -> None:
    both = BALL.replace('low = "floor"', 'low = "floor"\nhigh = { value = 1.3, unit = "m" }')
    with pytest.raises(PlantError, match="stops are in the wrong order"):
        shown(both, STILL, floor=1.4)


@pytest.mark.parametrize(
    ("right", "wrong", "words"),
    [
        ('low = "floor"', 'low = "flor"', "'flor' does not exist"),
        ('low = "floor"', 'low = { value = 2, unit = "m" }', "starts beyond its stop"),
        ('low = "floor"\n', "", "a restitution without a stop"),
        ('restitution = "back"', "restitution = 1.2", "restitution"),
        ("value = 0.8", "value = 1.8", "a restitution is a share of the speed"),
        ('rate = "speed"', 'rate = "2 * speed"', "a restitution needs a speed"),
        ('"floor"', '"floor"\nhigh = { value = 10, unit = "cm" }', "stops are in the wrong order"),
    ],
)
def test_a_stop_that_cannot_be_is_an_error(tmp_path, right: str, wrong: str, words: str) -> None:
    assert right in BALL
    with pytest.raises(InputError, match=words):
        system(tmp_path, BALL.replace(right, wrong))


@pytest.mark.parametrize(
    ("right", "wrong", "where"),
    [
        ('0.2, unit = "m"', '0.2, unit = "s"', "states.height.low"),
        ('0.8, unit = "1"', '0.8, unit = "m"', "states.height.restitution"),
    ],
)
def test_a_stop_has_the_unit_of_its_state(tmp_path, right: str, wrong: str, where: str) -> None:
    path = tmp_path / "ball.toml"
    path.write_text(BALL, encoding="utf-8")
    assert unit_faults(load_model_file(path), "ball.toml") == ()
    path.write_text(BALL.replace(right, wrong), encoding="utf-8")
    (found,) = unit_faults(load_model_file(path), "ball.toml")
    assert found.startswith(f"ball.toml: {where}: units do not agree")

"""A delayed quantity is the same quantity, later; the sensitivity to the dead time is its rate.

Between integer steps a simulation is linear in the dead time: its slope is that of a dead
time at most half a step away, and jumps at integer steps. So no dead time here is an integer.
"""

import tomllib
from typing import Any

import numpy as np
import pytest

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.fit.sensitivity import sensitivities
from slipbench.identification.mismatch.simulation.model import Point, models, predict
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sampling import Grid
from slipbench.identification.mismatch.systems.equations import equations
from slipbench.identification.mismatch.systems.expression import read_expression
from slipbench.identification.mismatch.systems.model_file import ModelFile
from slipbench.identification.mismatch.systems.run import run
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import InputError
from tests.identification.mismatch.laws.spring import MODEL, PERIOD, spring, swung

ROWS, DEAD_TIME = 300, 0.0437  # s: neither an integer number of rows nor of steps
LATE = MODEL.replace("gain * force", "gain * delay(force, dead_time)").replace(
    "[inputs.force]",
    '[parameters.dead_time]\nvalue = 42\nunit = "ms"\nplus_minus = 30\n\n[inputs.force]',
)
GAIN, FREQUENCY, DAMPING = 100.0, 10.0, 0.1


def shown(
    text: str, inputs: Floats, dead_time: float = DEAD_TIME, name: str = "place", **drive: Any
) -> Floats:
    """Run a model file with this dead time, s; return a column, (rows,). drive: of the input."""
    tree = tomllib.loads(text)
    tree["inputs"]["force"] |= drive
    tree["parameters"]["dead_time"] = {"value": 1e3 * dead_time, "unit": "ms"}
    file = ModelFile.model_validate(tree)
    read = equations(file, "test")
    values = np.array([number.si for number in file.parameters.values()])
    grid = Grid(ROWS, 0.0, ROWS, PERIOD, PERIOD)
    record = Record("test", 0.0, grid, inputs[:, None], {}, {}, np.zeros((ROWS, 0)))
    return run(read, file, values, (), record, np.zeros((ROWS, len(read.places))))[name]


def levels(seed: int = 3) -> Floats:
    """Force, V: a new level every seven rows."""
    print(f"seed {seed}")
    return np.repeat(np.random.default_rng(seed).standard_normal(ROWS // 7 + 1), 7)[:ROWS]


def after(waits: Floats) -> tuple[Floats, Floats]:
    """Position and speed of the spring so long after a step of 1 V, m and m/s; 0 before it."""
    t = np.maximum(waits, 0.0)
    w = FREQUENCY * np.sqrt(1.0 - DAMPING**2)
    loss = DAMPING * FREQUENCY
    fading = np.exp(-loss * t)
    position = 1.0 - fading * (np.cos(w * t) + loss / w * np.sin(w * t))
    speed = FREQUENCY**2 / w * fading * np.sin(w * t)
    return GAIN / FREQUENCY**2 * position, GAIN / FREQUENCY**2 * speed


def responses(force: Floats, dead_time: float) -> tuple[Floats, Floats]:
    """Position of a spring at rest before the first jump, and its derivative by the dead time."""
    force = force - force[0]
    ends = PERIOD * np.arange(1, ROWS + 1)
    jumps = np.diff(force, prepend=0.0)
    position, speed = after(ends[:, None] - PERIOD * np.arange(ROWS) - dead_time)
    return position @ jumps, -(speed @ jumps)


def test_a_constant_input_is_unchanged() -> None:
    force = np.full(ROWS, 0.7)
    assert np.array_equal(shown(LATE, force), shown(MODEL, force))


@pytest.mark.parametrize("held", [True, False])
def test_a_delay_of_0_is_no_delay(held: bool) -> None:
    plain = shown(MODEL, levels(), held=held)
    none = shown(LATE, levels(), dead_time=0.0, held=held)
    assert np.allclose(none, plain, rtol=0.0, atol=1e-12)
    constant = LATE.replace("dead_time)", "0)")
    assert np.allclose(shown(constant, levels(), held=held), plain, rtol=0.0, atol=1e-12)


def test_a_constant_time_is_that_parameter() -> None:
    constant = LATE.replace("dead_time)", f"{DEAD_TIME})")
    assert np.array_equal(shown(constant, levels()), shown(LATE, levels()))


@pytest.mark.parametrize("dead_time", [0.0013, 0.0437, 0.05, 0.73])
def test_the_answer_to_a_held_input_is_the_sum_of_late_step_responses(dead_time: float) -> None:
    force = levels() - levels()[0]
    expected, _ = responses(force, dead_time)
    error = shown(LATE, force, dead_time) - expected
    assert np.abs(error).max() < 0.004 * np.ptp(expected)


@pytest.mark.parametrize("dead_time", [0.0013, 0.0437, 0.0512])
def test_the_slope_along_the_dead_time_is_that_of_late_impulse_responses(dead_time: float) -> None:
    """Steps of 5 ms: differences of a thousandth of it and of a fifth of it give the same."""
    force = levels() - levels()[0]
    _, expected = responses(force, dead_time)
    for difference_step in (5e-6, 1e-3):
        there, back = (shown(LATE, force, dead_time + s * difference_step) for s in (1.0, -1.0))
        slope = (there - back) / (2.0 * difference_step)
        assert np.sqrt(np.mean((slope - expected) ** 2)) < 0.02 * np.std(expected)


@pytest.mark.parametrize("quantity", ["position", "deflection", "position * cos(velocity / 9)"])
def test_what_a_state_or_an_expression_was_is_shown_later(quantity: str) -> None:
    text = LATE.replace("delay(force, dead_time)", "force")
    head, tail = text.split('role = "place"\nvalue = "position"')
    now, late = (
        f'{head}role = "place"\nvalue = "{shows}"{tail}'
        for shows in (quantity, f"delay({quantity}, dead_time)")
    )
    force, ends = levels(), PERIOD * np.arange(1, ROWS + 1)
    expected = np.interp(ends - DEAD_TIME, ends, shown(now, force))
    error = (shown(late, force) - expected)[10:]
    assert np.abs(error).max() < 0.01 * np.ptp(expected)


def test_delays_add_up() -> None:
    twice = LATE.replace("delay(force, dead_time)", "delay(delay(force, 0.02), dead_time)")
    once = shown(LATE, levels(), DEAD_TIME + 0.02)
    assert np.allclose(shown(twice, levels()), once, atol=0.003 * np.ptp(once))


def test_the_engine_has_the_slope_of_central_differences(tmp_path) -> None:
    system = spring(tmp_path, LATE)
    (model,) = models(system, [system.prepare(swung(5, seconds=4.0))])
    point = model.origin()
    k = [c.name for c in model.known].index("dead_time")
    ours = sensitivities(model, point)[0][0][:, 0, k]
    step = 1e-3 * (np.arange(len(point.x)) == k)
    there, back = (
        predict(model, Point(point.x + s * step, point.q))[0][0][:, 0] for s in (1.0, -1.0)
    )
    slope = (there - back) / 2e-3 * model.known_bins[0][0][:, 0]
    assert np.std(slope) > 0.0
    assert np.sqrt(np.mean((ours - slope) ** 2)) < 0.02 * np.std(slope)


@pytest.mark.parametrize("seed", [21, 22])
def test_a_hidden_dead_time_is_recovered(tmp_path, seed: int) -> None:
    """The recorded force acts seven sampling periods later; the file states 42 +- 30 ms."""
    hidden = 0.07
    system = spring(tmp_path, LATE)
    ridden = swung(seed, felt=lambda u: np.concatenate((np.full(7, u[0]), u[:-7])))
    analysis = begin(system, [system.prepare(ridden)], [])
    fit = calibrate(analysis.training, analysis.training.origin())
    places = zip(fit.model.known, fit.point.x, strict=True)
    (found,) = (c.at(float(x)) for c, x in places if c.name == "dead_time")
    print(found)
    assert found == pytest.approx(hidden, abs=0.5e-3)


def test_a_delay_below_0_is_an_error(tmp_path) -> None:
    with pytest.raises(InputError, match=r"'dead_time' is the time of a delay, and below 0"):
        spring(tmp_path, LATE.replace("value = 42", "value = -42"))


@pytest.mark.parametrize("time", ["-0.1", "force", "2 * dead_time", "dead_time + 1"])
def test_the_time_of_a_delay_is_a_parameter_or_a_number(time: str) -> None:
    with pytest.raises(InputError, match="time of a delay is a parameter or a number of seconds"):
        read_expression(f"delay(force, {time})", ["force"], "somewhere", ["dead_time"])


@pytest.mark.parametrize("text", ["delay(force)", "delay(force, 1, 2)", "delay(force, time=1)"])
def test_a_delay_has_a_quantity_and_a_time(text: str) -> None:
    with pytest.raises(InputError, match="may not be called in an equation"):
        read_expression(text, ["force"], "somewhere")


def test_a_delay_longer_than_the_recording_is_an_error(tmp_path) -> None:
    system = spring(tmp_path, LATE.replace('unit = "ms"', 'unit = "s"'))
    with pytest.raises(InputError, match="as long as the recording"):
        system.prepare(swung(5, seconds=4.0))


def test_a_search_below_0_stays_at_no_delay(tmp_path) -> None:
    system = spring(tmp_path, LATE.replace("value = 42", "value = 0"))
    known = [c for c in system.coordinates([], None) if c.name == "dead_time"]
    below, none = (system.at(known, np.array([x]), ()).values for x in (-2.0, 0.0))
    assert np.array_equal(below, none)


def test_a_quantity_may_have_the_name_of_the_function() -> None:
    named = LATE.replace("dead_time", "delay")
    read = read_expression("delay(force, delay)", ["force"], "somewhere", ["delay"])
    assert read.names == {"force", "delay"}
    assert ModelFile.model_validate(tomllib.loads(named)).parameters["delay"].si == 0.042

"""Effects with memory agree with an independent simulation in short steps within one step.

A mass on a spring follows a command that is held between jumps, or interpolated linearly. Each
effect with a memory acts there, in the kernel and in an Euler simulation of 400 steps a row. The
kernel's error is compared with the change of the effect's trace within one step.
"""

import tomllib
from functools import cache

import numpy as np
import pytest

from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sampling import Grid
from slipbench.identification.mismatch.systems.effects.library import LIBRARY
from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.identification.mismatch.systems.equations import equations
from slipbench.identification.mismatch.systems.model_file import ActingEffect, ModelFile, Number
from slipbench.identification.mismatch.systems.placing import acting
from slipbench.identification.mismatch.systems.run import run
from tests.identification.mismatch.systems import plain_laws as plain

ROW, FINE, ROWS = 0.01, 400, 80
MODEL = """
name = "Mass on a spring"
period = "10 ms"
[inputs.command]
role = "command"
size = { value = 1, unit = "rad" }
[states.angle]
rate = "speed"
size = { value = 1, unit = "rad" }
[states.speed]
rate = "400 * pull - 12 * speed"
size = { value = 10, unit = "rad/s" }
[seams.wanted]
value = "command"
size = { value = 1, unit = "rad" }
[seams.pull]
value = "wanted - angle"
size = { value = 1, unit = "rad" }
along = "speed"
[outputs.encoder]
role = "encoder"
value = "angle"
size = { value = 1, unit = "rad" }
"""
ANYWHERE = ("command", "wanted", "pull")
LAWS = {
    "rate_limit": (ANYWHERE, {"limit": 0.6, "period": 0.01}, lambda: plain.slewed(60.0)),
    "jerk_limit": (("speed_rate",), {"limit": 200, "period": 0.01}, lambda: plain.slewed(2e4)),
    "braking_loop": (ANYWHERE, {"deceleration": 1000.0}, lambda: plain.braked(1000.0)),
    "hysteresis": (ANYWHERE, {"play": 0.3}, lambda: plain.plays(0.3)),
    "many_plays": (ANYWHERE, {"width": 0.8}, lambda: plain.plays(0.2, 0.4, 0.6, 0.8)),
    "bouc_wen": (("wanted", "pull"), {"share": 0.5, "level": 0.7}, lambda: plain.yields(0.5, 0.7)),
    "presliding": (("pull",), {"force": 0.2, "distance": 0.1}, lambda: plain.dahl(0.2, 0.1)),
    "delay": (ANYWHERE, {"delay": 0.023}, lambda: plain.late(0.023)),
    "lag": (ANYWHERE, {"time_constant": 0.02}, lambda: plain.trailing(0.02)),
    "moving_average": (("encoder",), {"window": 0.043}, lambda: plain.averaged(0.043)),
    "elastic_transmission": (
        ANYWHERE,
        {"share": 1.0, "frequency": 60.0, "damping": 0.2},
        lambda: plain.swinging(60.0, 0.2),
    ),
    "elastic_load": (
        ("speed_rate",),
        {"share": 0.4, "frequency": 60.0, "damping": 0.1},
        lambda: plain.beside(0.4, 60.0, 0.1),
    ),
    "elastic_backlash": (
        ("speed_rate",),
        {"share": 0.4, "frequency": 60.0, "damping": 0.1, "gap": 0.02},
        lambda: plain.beside(0.4, 60.0, 0.1, 0.02),
    ),
    "supply_sag": (ANYWHERE, {"sag": 0.2, "time_constant": 0.1}, lambda: plain.tired(0.2, 0.1, 1)),
    "thermal_gain": (
        ANYWHERE,
        {"loss": 0.2, "time_constant": 0.3},
        lambda: plain.tired(0.2, 0.3, 2),
    ),
}
"""Of every effect with a memory: places, parameters, and the textbook law."""
PLACED = [(name, place) for name, (places, _, _) in LAWS.items() for place in places]


@cache
def machine(held: bool, step: float) -> ModelFile:
    """The model file. step: of integration, s."""
    tree = tomllib.loads(MODEL)
    tree["inputs"]["command"]["held"] = held
    return ModelFile.model_validate({**tree, "step": f"{step} s"})


@cache
def command() -> np.ndarray:
    """A command of each row, rad: levels of one to eight rows."""
    rng = np.random.default_rng(11)
    lengths = rng.integers(1, 9, ROWS)
    return np.repeat(rng.standard_normal(ROWS), lengths)[:ROWS]


def in_kernel(held: bool, step: float, name: str = "", place: str = "") -> np.ndarray:
    """Reading at the end of each row, rad."""
    file = machine(held, step)
    read = equations(file, "test")
    effects: list[SeamEffect] = []
    if name:
        values = {k: Number(value=v) for k, v in LAWS[name][1].items()}
        entry = ActingEffect(name=name, at=place, values=values)
        effects = [acting(entry, file, "test")]
    grid = Grid(ROWS, 0.0, ROWS, ROW, ROW)
    inputs, none = command()[:, None], np.zeros((ROWS, 0))
    record = Record("test", 0.0, grid, inputs, {}, {}, none)
    zero_input = np.zeros((ROWS, len(read.places)))
    return run(read, file, np.zeros(0), effects, record, zero_input)["encoder"]


@cache
def in_short_steps(held: bool, name: str = "", place: str = "") -> np.ndarray:
    """Reading after each short step, rad, (ROWS, FINE): Euler's rule."""
    law = LAWS[name][2]() if name else plain.slewed(np.inf)
    command_values, h = command(), ROW / FINE
    angle, speed, shown = 0.0, 0.0, np.empty(ROWS * FINE)

    def acted(here: str, value: float) -> float:
        return law(value, speed, h) if here == place else value

    for k in range(ROWS * FINE):
        row, part = divmod(k, FINE)
        before = command_values[max(row - 1, 0)]
        line = before + (command_values[row] - before) * (part + 0.5) / FINE
        drive = acted("command", command_values[row] if held else line)
        pull = acted("pull", acted("wanted", drive) - angle)
        rate = acted("speed_rate", 400.0 * pull - 12.0 * speed)
        angle, speed = angle + h * (speed + 0.5 * h * rate), speed + h * rate
        shown[k] = acted("encoder", angle)
    return shown.reshape(ROWS, FINE)


def beside(held: bool, step: float, name: str, place: str) -> float:
    """Error of the kernel's trace of an effect, in changes of that trace within a step."""
    trace = in_short_steps(held, name, place) - in_short_steps(held)
    error = in_kernel(held, step, name, place) - in_kernel(held, step) - trace[:, -1]
    trace_values = trace.ravel()
    parts = round(FINE * step / ROW)
    shift = trace_values[parts:] - trace_values[:-parts]
    return float(np.sqrt(np.mean(error**2) / np.mean(shift**2)))


def test_every_effect_with_a_memory_has_its_law_here():
    assert set(LAWS) == {k.name for k in LIBRARY if k.remembers or k.states or k.delay_parameter}


@pytest.mark.parametrize("held", [True, False], ids=["held", "line"])
@pytest.mark.parametrize(("name", "place"), PLACED)
def test_a_memory_is_not_a_step_beside_an_independent_simulation(name, place, held):
    slack = 0.35 if name == "braking_loop" and not held else 0.1  # two halves stand for one motion
    assert beside(held, 0.5 * ROW, name, place) < slack

"""The variables of the FMU: inputs, parameters of the vehicle file, initial states, outputs."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from slipbench.plant.fmu.model import FmuModel
from slipbench.plant.motorcycle import GEAR_RANGE
from slipbench.plant.parameters import Parameter
from slipbench.plant.signals import Column, Inputs, Outputs

PRESCRIBED = ("measured_", "kept_")
"""Inputs that belong to an analysis, not to a motorcycle, begin with these."""
INPUT, PARAMETER, RATIO, INITIAL, OUTPUT = "INPUT", "PARAMETER", "RATIO", "INITIAL", "OUTPUT"
UNKNOWN_UNIT = ""
"""Of the states of effects, which do not state one."""
RANGES = {
    "throttle_command": (0.0, 1.0),
    "clutch": (0.0, 1.0),
    "grip": (0.0, 10.0),
    "load": (0.0, 10.0),
    "air_temperature": (150.0, 400.0),
}
"""Values of inputs beyond which the equations mean nothing."""


@dataclass(frozen=True)
class Variable:
    """A real variable. index: its place among those of its kind in the kernel. All in SI."""

    name: str
    kind: str
    index: int
    unit: str
    text: str
    start: float = 0.0
    low: float = -math.inf
    high: float = math.inf
    whole: bool = False

    @property
    def bounds(self) -> tuple[float, float]:
        """Least and greatest value; none where the start is beyond them ("no limit")."""
        inside = self.low <= self.start <= self.high
        return (self.low, self.high) if inside else (-math.inf, math.inf)


def variables(model: FmuModel) -> list[Variable]:
    """Return all variables; the value reference of each is its place plus 1."""
    return [
        *_inputs(model),
        *_parameters(model),
        *_ratios(model),
        *_initial(model),
        *_outputs(model),
    ]


def _inputs(model: FmuModel) -> Iterator[Variable]:
    starts = {"throttle_command": model.command, "gear": float(model.gear)}
    gears = float(len(model.motorcycle.gears))
    for index, name in enumerate(Inputs.names):
        if not name.startswith(PRESCRIBED):
            column = _column(Inputs, name)
            start = starts.get(name, column.rest)
            whole = name == "gear"
            low, high = (0.0, gears) if whole else RANGES.get(name, (-math.inf, math.inf))
            yield Variable(name, INPUT, index, column.unit, column.text, start, low, high, whole)


def _parameters(model: FmuModel) -> Iterator[Variable]:
    """Yield the parameters of blocks and of effects that are present."""
    place = {name: index for index, name in enumerate(model.layout.parameters)}
    values = model.parameters
    for block, part in model.motorcycle.blocks():
        for p in part.parameters():
            index = place[f"{block}_{p.name}"]
            yield _parameter(f"{block}.{p.name}", index, p, float(values[index]))
    for effect in model.layout.effects:
        for p in effect.parameters():
            index = place[f"{effect.name}.{p.name}"]
            yield _parameter(f"effects.{effect.name}.{p.name}", index, p, float(values[index]))


def _parameter(name: str, index: int, known: Parameter, start: float) -> Variable:
    bounds = (known.low, known.high)
    return Variable(name, PARAMETER, index, known.unit, known.text, start, *bounds, known.whole)


def _ratios(model: FmuModel) -> Iterator[Variable]:
    text = "crank turns per turn of the rear wheel"
    for index, ratio in enumerate(model.motorcycle.gears):
        yield Variable(f"gears[{index + 1}]", RATIO, index, "1", text, ratio, *GEAR_RANGE)


def _initial(model: FmuModel) -> Iterator[Variable]:
    for index, name in enumerate(model.layout.states):
        unit = vars(Outputs)[name].unit if name in Outputs.names else UNKNOWN_UNIT
        start = model.initial[name]
        yield Variable(f"initial.{name}", INITIAL, index, unit, "value at the start", start)


def _outputs(model: FmuModel) -> Iterator[Variable]:
    for index, name in enumerate(Outputs.names):
        if name != "time":  # that of the master
            column = _column(Outputs, name)
            yield Variable(name, OUTPUT, index, column.unit, column.text)
    first = len(Outputs.names)
    for index, name in enumerate(model.layout.effect_states):
        yield Variable(name, OUTPUT, first + index, UNKNOWN_UNIT, "state of an effect")


def _column(table: type[Inputs] | type[Outputs], name: str) -> Column:
    found = vars(table)[name]
    assert isinstance(found, Column)
    return found

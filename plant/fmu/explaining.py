"""The file beside an exported FMU, from which `slipbench explain` reads what is uncertain and recorded."""

from collections.abc import Iterator, Mapping

from slipbench.plant.fmu.model import FmuModel
from slipbench.plant.fmu.variables import PARAMETER, RATIO, Variable, variables

INPUTS = {"throttle_command": "throttle_command", "spark": "spark_command", "gear": "gear"}
"""Role of the recordings of each input that a bench records."""
OUTPUTS = {
    "throttle": "throttle_position",
    "engine_speed": "engine_speed",
    "optical_speed": "optical_speed",
}
SIZES = {
    "throttle_command": 0.1,
    "spark": 0.1,
    "gear": 1.0,
    "throttle": 0.1,
    "engine_speed": 1000.0,
    "optical_speed": 50.0,
}
"""Usual magnitudes on a track, SI."""


def file_beside(model: FmuModel, plus_minus: Mapping[str, float]) -> str:
    """Return the text. plus_minus: 95 % half widths, SI, of a vehicle file's parameters by name."""
    return "\n".join(_lines(model, plus_minus)) + "\n"


def _lines(model: FmuModel, plus_minus: Mapping[str, float]) -> Iterator[str]:
    yield f'name = "{model.name}"'
    yield 'step = "1 ms"\nperiod = "10 ms"\ntime_limit = "120 s"'
    for one in variables(model):
        half = plus_minus.get(one.name.replace("[", ".").replace("]", ""), 0.0)
        if one.kind in (PARAMETER, RATIO) and half > 0.0:
            yield from _parameter(one, half)
    yield from _ports("inputs", INPUTS, model)
    yield from _ports("outputs", OUTPUTS, model)


def _parameter(one: Variable, half: float) -> Iterator[str]:
    yield f"\n[parameters.{one.name.replace('.', '_').replace('[', '_').replace(']', '')}]"
    yield f'variable = "{one.name}"'
    yield f'value = {one.start!r}\nunit = "{_pint(one.unit)}"\nplus_minus = {half!r}'


def _ports(section: str, roles: Mapping[str, str], model: FmuModel) -> Iterator[str]:
    units = {one.name: one.unit for one in variables(model)}
    for name, role in roles.items():
        yield f"\n[{section}.{name}]"
        yield f'role = "{role}"\nsize = {{ value = {SIZES[name]:g}, unit = "{units[name]}" }}'
        if name == "gear":
            yield "exact = true"


def _pint(unit: str) -> str:
    return unit.replace(" ", "*") or "1"

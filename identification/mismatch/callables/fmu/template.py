"""Template of the TOML file of an FMU, from its model description."""

from collections.abc import Iterable, Iterator
from typing import Any

from slipbench.identification.mismatch.callables.fmu.elements import Element
from slipbench.identification.mismatch.callables.fmu.kinds import kind_of
from slipbench.identification.mismatch.callables.fmu.units import pint_name
from slipbench.identification.mismatch.callables.fmu.unpacked import UnpackedFmu
from slipbench.identification.mismatch.callables.fmu.variables import is_number, suited

MOST = 6
"""Limit of the listed variables of each kind."""
STEP, PERIOD = 0.001, 0.01
"""Defaults where the FMU states no step, s."""


def template(fmu: UnpackedFmu) -> str:
    """Return the TOML text with half widths of 20 %, roles equal to FMU names, and sizes of 1."""
    return "\n".join(_lines(fmu.description, fmu.path.name))


def _lines(description: Any, file: str) -> Iterator[str]:
    step = _step(description)
    yield f'fmu = "{file}"'
    yield f'step = "{step:g} s"'
    yield f'period = "{max(step, PERIOD):g} s"'
    for section, causality in (
        ("parameters", "parameter"),
        ("inputs", "input"),
        ("outputs", "output"),
    ):
        candidates = suited(description, causality)
        found = [element for element in candidates if element.variable.causality == causality]
        if section == "parameters":
            found = [element for element in found if not _is_integer(description, element)]
        yield from _entries(section, found[:MOST])
        if len(found) > MOST:
            yield f"# and {len(found) - MOST} more {section}: {_names(found[MOST:])}"
    if non_numeric := [v for v in description.modelVariables if not is_number(description, v)]:
        yield f"# left out, no numbers: {', '.join(f'{v.name} ({v.type})' for v in non_numeric)}"


def _step(description: Any) -> float:
    """Return the step that the FMU specifies, s."""
    solver, experiment = description.coSimulation, description.defaultExperiment
    own = getattr(solver, "fixedInternalStepSize", None) or getattr(experiment, "stepSize", None)
    return float(own or STEP)


def _is_integer(description: Any, element: Element) -> bool:
    """Return whether a number is of integer type: such a parameter cannot be calibrated."""
    kind = kind_of(str(description.fmiVersion), element.variable.type)
    return kind is not None and kind.whole


def _names(found: list[Element]) -> str:
    names = [element.name for element in found[:MOST]]
    return ", ".join(names) + (" ..." if len(found) > MOST else "")


def _entries(section: str, found: Iterable[Element]) -> Iterator[str]:
    keys: set[str] = set()
    for element in found:
        variable = element.variable
        key = _key(element.name, keys)
        unit = pint_name(variable.unit or getattr(variable.declaredType, "unit", None) or "1")
        yield f"[{section}.{key}]"
        yield f'variable = "{element.name}"'
        if section == "parameters":
            start = float(element.start or 0.0)
            yield f'value = {start:g}\nunit = "{unit}"\nplus_minus = {0.2 * abs(start) or 1.0:g}'
        else:
            yield f'role = "{key}"\nsize = {{ value = 1, unit = "{unit}" }}'


def _key(name: str, keys: set[str]) -> str:
    """Return a unique name in the TOML file within its section."""
    stem = "".join(c if c.isalnum() else "_" for c in name).rstrip("_")
    key, number = stem, 1
    while key in keys:
        number += 1
        key = f"{stem}_{number}"
    keys.add(key)
    return key

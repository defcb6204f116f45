"""A first file beside an FMU, from what the FMU tells of itself."""

from collections.abc import Iterable, Iterator
from typing import Any

from slipbench.identification.mismatch.callables.fmu.unpacked import UnpackedFmu
from slipbench.identification.mismatch.callables.fmu.variables import is_array, is_real, pint_name

MOST = 6
"""Variables of a kind that are listed."""
STEP, PERIOD = "1 ms", "10 ms"


def template(fmu: UnpackedFmu) -> str:
    """Return the text, with half widths of 20 %, roles that are the FMU's names, and sizes of 1."""
    return "\n".join(_lines(fmu.description, fmu.path.name))


def _lines(description: Any, file: str) -> Iterator[str]:
    yield f'fmu = "{file}"'
    yield f'step = "{STEP}"'
    yield f'period = "{PERIOD}"'
    for section, causality in (
        ("parameters", "parameter"),
        ("inputs", "input"),
        ("outputs", "output"),
    ):
        found = [v for v in description.modelVariables if v.causality == causality]
        real = [v for v in found if is_real(v)]
        yield from _entries(section, real[:MOST])
        if len(real) > MOST:
            yield f"# and {len(real) - MOST} more {section}"
        if arrays := [v.name for v in found if is_array(v)]:
            yield f"# arrays cannot be bound: {', '.join(arrays)}"


def _entries(section: str, variables: Iterable[Any]) -> Iterator[str]:
    for variable in variables:
        key = "".join(c if c.isalnum() else "_" for c in variable.name)
        unit = pint_name(variable.unit or getattr(variable.declaredType, "unit", None) or "1")
        yield f"[{section}.{key}]"
        yield f'variable = "{variable.name}"'
        if section == "parameters":
            start = float(variable.start or 0.0)
            yield f'value = {start:g}\nunit = "{unit}"\nplus_minus = {0.2 * abs(start) or 1.0:g}'
        else:
            yield f'role = "{key}"\nsize = {{ value = 1, unit = "{unit}" }}'

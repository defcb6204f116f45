"""Units of the plant as FMI writes them: names of Modelica, and exponents of the base units."""

import re
from dataclasses import dataclass

from slipbench.plant.units import base_exponents

BASE = {
    "kilogram": "kg",
    "meter": "m",
    "second": "s",
    "ampere": "A",
    "kelvin": "K",
    "mole": "mol",
    "candela": "cd",
    "radian": "rad",
}


@dataclass(frozen=True)
class Unit:
    """name: "kg.m2"; exponents: of the base units by FMI's names; their factor is 1."""

    name: str
    exponents: dict[str, int]


def fmi_unit(unit: str) -> Unit | None:
    """Return a unit of the plant, such as "kg m^2"; None for one without dimension or unknown."""
    if unit in ("", "1"):
        return None
    name = re.sub(r"(?<=\w)[ *](?=\w)", ".", unit).replace("^", "")
    exponents = {BASE[key]: power for key, power in base_exponents(unit).items()}
    return Unit(name, exponents)

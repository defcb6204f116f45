"""Units in which a vehicle or model file is written, so that results can be read in them."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from slipbench.protocol.units import linear, to_base

MOST_POWER = 3


@dataclass(frozen=True)
class WrittenUnits:
    """SI unit -> unit of the file.

    common: where the file writes only one unit for the SI unit. quantities: by name of a quantity,
    its SI unit and its unit in the file.
    """

    common: Mapping[str, str] = field(default_factory=dict)
    quantities: Mapping[str, tuple[str, str]] = field(default_factory=dict)

    @classmethod
    def of_tree(
        cls, tree: Any, quantities: Mapping[str, tuple[str, str]] | None = None
    ) -> "WrittenUnits":
        """Units of all numbers `{ value, unit }` of a file's tree."""
        found: dict[str, set[str]] = {}
        for unit in _units(tree):
            with suppress(ValueError):  # a unit that cannot be converted here is read in SI
                found.setdefault(to_base(unit)[2], set()).add(unit)
        common = {si: units.pop() for si, units in found.items() if len(units) == 1}
        return cls(common, quantities or {})

    def factor(self, si: str, *quantities: str) -> tuple[float, str]:
        """Factor from SI and unit of a value of the named quantities; 1 and `si` if written in SI.

        Powers of a unit are known as well: 1/rad^2 is read in 1/deg^2.
        """
        own = [self.quantities[q] for q in quantities if q in self.quantities]
        for base, written in (*own, *self.common.items()):
            for power in range(1, MOST_POWER + 1):
                for inverse in (False, True):
                    if si == power_of(base, power, inverse) and base != "1":
                        return _factor(si, power_of(written, power, inverse))
                    if si == base == "1" and power == 1:
                        return _factor(si, written)
        return 1.0, si


SI = WrittenUnits()
"""Everything is read in SI."""


def power_of(unit: str, power: int, inverse: bool) -> str:
    """Name of a power of a unit: m^2, (m/s)*(m/s), 1/m, 1/m^2, 1/(m/s), 1/(m/s)/(m/s).

    A power of a bracket is no unit that files may write (protocol/units.py).
    """
    if unit.replace("_", "").isalnum():
        name = unit if power == 1 else f"{unit}^{power}"
        return f"1/{name}" if inverse else name
    bracket = f"({unit})"
    if inverse:
        return "1" + f"/{bracket}" * power
    return unit if power == 1 else "*".join([bracket] * power)


def _factor(si: str, written: str) -> tuple[float, str]:
    try:
        slope, offset = linear(si, written)
    except ValueError:
        return 1.0, si
    return (slope, written) if offset == 0.0 and slope != 1.0 else (1.0, si)


def _units(tree: Any) -> Iterable[str]:
    if isinstance(tree, Mapping):
        if "value" in tree and isinstance(tree.get("unit"), str):
            yield tree["unit"]
            return
        tree = list(tree.values())
    if isinstance(tree, list):
        for part in tree:
            yield from _units(part)

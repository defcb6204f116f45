"""Units in which a vehicle or model file is written, so that results can be stated in them."""

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
        """Return the units of all numbers `{ value, unit }` of a file's tree."""
        written_as: dict[str, set[str]] = {}
        for unit in _units(tree):
            with suppress(ValueError):  # a unit that cannot be converted here is read in SI
                written_as.setdefault(to_base(unit)[2], set()).add(unit)
        common = {si: units.pop() for si, units in written_as.items() if len(units) == 1}
        return cls(common, quantities or {})

    def factor(self, si: str, *quantities: str) -> tuple[float, str]:
        """Return the factor from SI and the unit of the named quantities; 1 and `si` if in SI.

        Powers of a unit are converted as well: 1/rad^2 to 1/deg^2.
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
"""All values are in SI."""


def power_of(unit: str, power: int, inverse: bool) -> str:
    """Return the name of a power of a unit: m^2, (m/s)*(m/s), 1/m, 1/m^2, 1/(m/s), 1/(m/s)/(m/s).

    Files may not write a power of a bracket (protocol/units.py).
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

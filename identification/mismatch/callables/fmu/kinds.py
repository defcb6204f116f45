"""Types of the numbers of an FMU: storage, and which of them are integers."""

import ctypes
from dataclasses import dataclass
from typing import Any

import numpy as np

from slipbench.plant.signals import Floats

LARGEST = 2.0**53
"""Largest magnitude up to which a float represents every integer."""


@dataclass(frozen=True)
class Kind:
    """A type. name: in the FMI functions that set and read it; stored: its C type."""

    name: str
    stored: type[Any]

    @property
    def whole(self) -> bool:
        """Whether its values are integers, or true and false as 1 and 0."""
        return not issubclass(self.stored, ctypes.c_double | ctypes.c_float)

    def fitting(self, values: Floats) -> Floats:
        """Return the nearest representable values of the type, in the shape of `values`."""
        if not self.whole:
            return values
        low, high = self._range
        return np.asarray(np.clip(np.rint(values), low, high), np.float64)

    @property
    def _range(self) -> tuple[float, float]:
        if self.stored is ctypes.c_bool or self.name == "Boolean":
            return 0.0, 1.0
        limits = np.iinfo(np.dtype(self.stored))
        return max(float(limits.min), -LARGEST), min(float(limits.max), LARGEST)


INTEGERS = {
    f"{sign}{bits}": getattr(ctypes, f"c_{sign.lower()}{bits}")
    for sign in ("Int", "UInt")
    for bits in (8, 16, 32, 64)
}
REAL = Kind("Real", ctypes.c_double)
KINDS = {
    "2.0": {
        "Real": REAL,
        "Integer": Kind("Integer", ctypes.c_int),
        "Enumeration": Kind("Integer", ctypes.c_int),
        "Boolean": Kind("Boolean", ctypes.c_int),
    },
    "3.0": {
        "Float64": Kind("Float64", ctypes.c_double),
        "Float32": Kind("Float32", ctypes.c_float),
        **{name: Kind(name, stored) for name, stored in INTEGERS.items()},
        "Enumeration": Kind("Int64", ctypes.c_int64),
        "Boolean": Kind("Boolean", ctypes.c_bool),
    },
}
"""By FMI version and type of the model description; strings, binaries, clocks are not numeric."""
PLAIN = ("Real", "Float64")
"""Names of the types that a wrapper FMU supports."""


def kind_of(version: str, type_name: str) -> Kind | None:
    """Return a type; None where its values are not numeric. version: of FMI, "2.0" or later."""
    return KINDS[version[:3]].get(type_name)

"""Variables of an FMU that are set or read together: one call for each type."""

import ctypes
from collections.abc import Sequence

import numpy as np

from slipbench.identification.mismatch.callables.fmu.kinds import Kind
from slipbench.identification.mismatch.callables.fmu.variables import Port
from slipbench.plant.signals import Floats


class Group:
    """Variables of one type, as FMI takes them. fixed while the library is loaded.

    variables: how many; count: of their numbers, since an array has several.
    """

    def __init__(self, kind: Kind, ports: Sequence[tuple[int, Port]]) -> None:
        """ports: with their places among all that are set or read together."""
        starts = {port.reference: port.starts for _, port in ports}
        begins = dict(zip(starts, np.cumsum([0, *map(len, starts.values())]), strict=False))
        self.kind, self.name, self.variables = kind, kind.name, len(starts)
        self.count = sum(map(len, starts.values()))
        self.references = (ctypes.c_uint32 * self.variables)(*starts)
        self.values = (kind.stored * self.count)()
        self._array = np.ctypeslib.as_array(self.values)
        self._array[:] = np.concatenate([np.array(told) for told in starts.values()])
        self._outside = np.array([place for place, _ in ports])
        self._inside = np.array([begins[port.reference] + port.index for _, port in ports])

    def put(self, values: Floats) -> None:
        """Write numbers into the array; elements that no port names keep their start values.

        values: of all that are set together.
        """
        self._array[self._inside] = self.kind.fitting(values[self._outside])

    def take(self, values: Floats) -> None:
        """Write what the array holds into values, those of all that are read together."""
        values[self._outside] = self._array[self._inside]


class Values:
    """Variables that are set or read together. count: of all ports."""

    def __init__(self, ports: Sequence[Port], discrete: bool | None = None) -> None:
        """ports: in the order of the values. discrete: those that are, or not, alone; None: all."""
        self.count = len(ports)
        places: dict[Kind, list[tuple[int, Port]]] = {}
        for place, port in enumerate(ports):
            if discrete is None or port.discrete == discrete:
                places.setdefault(port.kind, []).append((place, port))
        self.groups = tuple(Group(kind, found) for kind, found in places.items())

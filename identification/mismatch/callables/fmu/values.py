"""Variables of an FMU that are set or read together, with one call for each type."""

import ctypes
from collections.abc import Sequence

import numpy as np

from slipbench.identification.mismatch.callables.fmu.kinds import Kind
from slipbench.identification.mismatch.callables.fmu.variables import Port
from slipbench.plant.signals import Floats


class Group:
    """Variables of one type, with the arrays for FMI; constant while the library is loaded.

    variables: number of variables; count: number of their elements, since an array has several.
    """

    def __init__(self, kind: Kind, ports: Sequence[tuple[int, Port]]) -> None:
        """ports: with their indices among all ports that are set or read together."""
        starts = {port.reference: port.starts for _, port in ports}
        begins = dict(zip(starts, np.cumsum([0, *map(len, starts.values())]), strict=False))
        self.kind, self.name, self.variables = kind, kind.name, len(starts)
        self.count = sum(map(len, starts.values()))
        self.references = (ctypes.c_uint32 * self.variables)(*starts)
        self.values = (kind.stored * self.count)()
        self._array = np.ctypeslib.as_array(self.values)
        self._array[:] = np.concatenate([np.array(numbers) for numbers in starts.values()])
        self._port_indices = np.array([position for position, _ in ports])
        self._element_indices = np.array([begins[port.reference] + port.index for _, port in ports])

    def put(self, values: Floats) -> None:
        """Write values into the array; elements without a port keep their start values.

        values: of all ports that are set together, shape (ports,), in units of the FMU.
        """
        self._array[self._element_indices] = self.kind.fitting(values[self._port_indices])

    def take(self, values: Floats) -> None:
        """Copy the array into values, those of all ports that are read together.

        values: shape (ports,), in units of the FMU.
        """
        values[self._port_indices] = self._array[self._element_indices]


class Values:
    """Variables that are set or read together. count: number of ports."""

    def __init__(self, ports: Sequence[Port], discrete: bool | None = None) -> None:
        """ports: in the order of the values. discrete: select ports by this property; None: all."""
        self.count = len(ports)
        by_kind: dict[Kind, list[tuple[int, Port]]] = {}
        for position, port in enumerate(ports):
            if discrete is None or port.discrete == discrete:
                by_kind.setdefault(port.kind, []).append((position, port))
        self.groups = tuple(Group(kind, ports_of_kind) for kind, ports_of_kind in by_kind.items())

"""How an FMU is run: its library, its interface, and the variables that are set and read."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from slipbench.identification.mismatch.callables.fmu.unpacked import INTERFACES, UnpackedFmu
from slipbench.identification.mismatch.callables.fmu.variables import Port, StatePort
from slipbench.plant.signals import Floats


@dataclass(frozen=True, eq=False)
class Plan:
    """interface: co_simulation or model_exchange. step: largest step, s.

    held: for each input, whether it holds between samples. states: on whose derivatives effects act.
    """

    fmu: UnpackedFmu
    interface: str
    step: float
    parameters: tuple[Port, ...]
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    held: tuple[bool, ...]
    states: tuple[StatePort, ...] = ()

    @property
    def identifier(self) -> str:
        """Name of the FMU's library."""
        return str(self._offered.modelIdentifier)

    @property
    def absent_tool(self) -> str:
        """What to say where the FMU does not start, if it needs the tool that made it; else empty."""
        if not self._offered.needsExecutionTool:
            return ""
        tool = self.fmu.description.generationTool or "unknown"
        return f" It needs the tool that made it ({tool}): install that here, or export without it."

    @property
    def _offered(self) -> Any:
        return getattr(self.fmu.description, INTERFACES[self.interface])

    def loading(self) -> dict[str, object]:
        """Return what fmpy loads the library with."""
        return {
            "guid": self.fmu.description.guid,
            "unzipDirectory": str(self.fmu.folder),
            "modelIdentifier": self.identifier,
            "instanceName": self.identifier,
            "requireFunctions": False,
        }


def inside(
    ports: tuple[Port, ...], values: Mapping[str, Floats | float], shape: tuple[int, ...] = ()
) -> Floats:
    """Return values in the units of the FMU, ports along the last axis. shape: of each value."""
    found = np.empty((*shape, len(ports)))
    for k, port in enumerate(ports):
        found[..., k] = port.slope * np.asarray(values[port.name]) + port.offset
    return found


def outside(ports: tuple[Port, ...], rows: Floats) -> dict[str, Floats]:
    """Return values in the units of the file. rows: (n, ports)."""
    return {p.name: (rows[:, k] - p.offset) / p.slope for k, p in enumerate(ports)}

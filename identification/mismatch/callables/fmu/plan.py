"""Configuration of an FMU run: library, interface, and the variables that are set and read."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from slipbench.identification.mismatch.callables.fmu.unpacked import INTERFACES, UnpackedFmu
from slipbench.identification.mismatch.callables.fmu.variables import Port, StatePort
from slipbench.plant.signals import Floats


@dataclass(frozen=True, eq=False)
class Plan:
    """Configuration of an FMU run.

    interface: co_simulation or model_exchange. step: largest step, s. held: for each input, whether
    it is held between samples. states: those on whose derivatives effects act.
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
        return str(self._interface_description.modelIdentifier)

    @property
    def absent_tool(self) -> str:
        """Hint for an FMU that does not start without its authoring tool; else empty."""
        if not self._interface_description.needsExecutionTool:
            return ""
        tool = self.fmu.description.generationTool or "unknown"
        return f" It needs the tool that made it ({tool}): install that here, or export without it."

    @property
    def _interface_description(self) -> Any:
        return getattr(self.fmu.description, INTERFACES[self.interface])

    def loading(self) -> dict[str, object]:
        """Return the arguments with which fmpy loads the library."""
        return {
            "guid": self.fmu.description.guid,
            "unzipDirectory": str(self.fmu.folder),
            "modelIdentifier": self.identifier,
            "instanceName": self.identifier,
            "requireFunctions": False,
        }


def to_fmu_units(
    ports: tuple[Port, ...], values: Mapping[str, Floats | float], shape: tuple[int, ...] = ()
) -> Floats:
    """Return values in the units of the FMU, ports on the last axis. shape: of each value."""
    converted = np.empty((*shape, len(ports)))
    for k, port in enumerate(ports):
        converted[..., k] = port.slope * np.asarray(values[port.name]) + port.offset
    return converted


def from_fmu_units(ports: tuple[Port, ...], rows: Floats) -> dict[str, Floats]:
    """Return values in the units of the TOML file, by port name. rows: (n, ports), FMU units."""
    return {p.name: (rows[:, k] - p.offset) / p.slope for k, p in enumerate(ports)}

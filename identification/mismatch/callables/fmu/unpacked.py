"""An FMU unpacked into a temporary folder, with its description and a binary for this platform."""

import shutil
import zipfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from tempfile import mkdtemp
from typing import Any
from weakref import finalize

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library

VERSIONS = ("2.0", "3.0")
INTERFACES = {"co_simulation": "coSimulation", "model_exchange": "modelExchange"}


@dataclass(frozen=True, eq=False)
class UnpackedFmu:
    """An unpacked FMU.

    path: of the FMU. description: fmpy's ModelDescription. folder: removed with this object.
    """

    path: Path
    description: Any
    folder: Path

    @property
    def version(self) -> str:
        """Version of FMI: "2.0" or "3.0"."""
        return str(self.description.fmiVersion)[:3]

    def interface(self, wanted: str) -> str:
        """Return co_simulation or model_exchange. wanted: requested interface; empty: any.

        Raises InputError where the FMU does not offer it, or has input clocks.
        """
        offered = [name for name, key in INTERFACES.items() if getattr(self.description, key)]
        if not offered or (wanted and wanted not in offered):
            raise InputError(
                f"the FMU has no interface for {wanted.replace('_', '-') or 'simulation'}",
                where=str(self.path),
                found=", ".join(offered) or _unsupported_interfaces(self.description),
                remedy="export it for co-simulation",
            )
        chosen = wanted or offered[0]
        self._reject_input_clocks()
        return chosen

    def _reject_input_clocks(self) -> None:
        """Raise InputError where the FMU has input clocks, other than those of a network.

        FMI-LS-BUS: clocks of binary variables alone exchange frames. They do not tick on a bus to
        which nothing is connected.
        """
        variables = self.description.modelVariables
        ticked = [
            v.name
            for v in variables
            if v.type == "Clock" and v.causality == "input" and not _of_a_network(v, variables)
        ]
        if ticked:
            raise InputError(
                "the FMU has clocks that the simulation around it has to tick",
                where=str(self.path),
                expected="an FMU whose clocks, if any, tick by themselves (causality output)",
                found=f"input clocks {', '.join(ticked)}",
                remedy="export it without clocks: sampled parts as time events",
            )


def _of_a_network(clock: Any, variables: Iterable[Any]) -> bool:
    """Return whether a clock has variables, and all of them are binary."""
    types = {v.type for v in variables if any(c.name == clock.name for c in v.clocks or ())}
    return types == {"Binary"}


def _unsupported_interfaces(description: Any) -> str:
    return (
        "scheduled execution alone, which needs a scheduler"
        if getattr(description, "scheduledExecution", None)
        else "neither co-simulation nor model exchange"
    )


def unpacked(path: Path) -> UnpackedFmu:
    """Unpack an FMU. Raises InputError where it is invalid, or not for this platform."""
    fmpy = optional_library("fmpy")
    reading = optional_library("fmpy.model_description")
    try:
        description = reading.read_model_description(str(path), validate=False)
        platforms = fmpy.supported_platforms(str(path))
    except FileNotFoundError as fault:
        raise InputError("there is no such FMU", where=str(path)) from fault
    except (OSError, zipfile.BadZipFile, KeyError) as fault:
        raise _not_an_fmu(path, fault) from fault
    except Exception as fault:  # fmpy raises plain exceptions for invalid descriptions
        raise _not_an_fmu(path, fault) from fault
    if str(description.fmiVersion)[:3] not in VERSIONS:
        raise InputError(
            "the version of FMI is not supported",
            where=str(path),
            expected=" or ".join(VERSIONS),
            found=str(description.fmiVersion),
        )
    if fmpy.platform not in platforms and f"{fmpy.architecture}-{fmpy.system}" not in platforms:
        raise InputError(
            "the FMU has no binary for this platform",
            where=str(path),
            expected=fmpy.platform,
            found=", ".join(platforms) or "no binary",
            remedy="export it for this platform, or compile its sources with fmpy",
        )
    fmu = UnpackedFmu(path, description, Path(mkdtemp(prefix="slipbench-fmu-")))
    # Not a TemporaryDirectory: it warns where it is garbage-collected before it is closed.
    finalize(fmu, shutil.rmtree, fmu.folder, ignore_errors=True)
    fmpy.extract(str(path), str(fmu.folder))
    return fmu


def _not_an_fmu(path: Path, fault: Exception) -> InputError:
    return InputError("this is no valid FMU", where=str(path), found=str(fault))

"""An FMU as a file: its description, and its library for this platform."""

import hashlib
import platform
import zipfile
from pathlib import Path
from tempfile import TemporaryDirectory

from slipbench.plant.fmu.bus import Bus
from slipbench.plant.fmu.bus_description import MANIFEST, TERMINALS, manifest, terminals
from slipbench.plant.fmu.description import IDENTIFIER, description
from slipbench.plant.fmu.kernel_object import entry_text, kernel_object
from slipbench.plant.fmu.library import SOURCES, SUFFIXES, binary_folder, link
from slipbench.plant.fmu.model import FmuModel
from slipbench.plant.fmu.tables import tables
from slipbench.plant.fmu.variables import variables

VERSIONS = (2, 3)


def write_fmu(
    path: Path, model: FmuModel, version: int, headers: Path, bus: Bus | None = None
) -> None:
    """Write an FMU for co-simulation. version: of FMI, 2 or 3; bus: frames on CAN, of FMI 3.0 only.

    headers: folder of the header files of FMI. Raises PlantError where there is no compiler, or the
    platform is not supported; ValueError where frames cannot be sent at multiples of the internal
    step; OSError where the file cannot be written.
    """
    folder = binary_folder(version)
    listed = variables(model)
    token = _token(model, tables(model, listed, "", bus))
    header = tables(model, listed, token, bus)
    with TemporaryDirectory(prefix="slipbench-fmu-") as name:
        work = Path(name)
        (work / "tables.h").write_text(header, encoding="utf-8")
        (work / "kernel.o").write_bytes(kernel_object(model.layout.effects))
        names = ["motorcycle.c", f"fmi{version}.c", f"absent{version}.c"]
        names += [] if bus is None else ["can.c", "bus3.c"]
        library = link([SOURCES / name for name in names], work, headers)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("modelDescription.xml", description(version, model, listed, token, bus))
        if bus is not None:
            packed.writestr(TERMINALS, terminals(bus))
            packed.writestr(MANIFEST, manifest())
        packed.writestr(f"binaries/{folder}/{IDENTIFIER}{SUFFIXES[platform.system()]}", library)


def _token(model: FmuModel, header: str) -> str:
    """Return what names this FMU: it changes with equations, effects, numbers and names."""
    sources = [file.read_bytes() for file in sorted(SOURCES.iterdir())]
    text = f"{model.name}\n{entry_text(model.layout.effects)}\n{header}".encode()
    return "{" + hashlib.sha256(b"\n".join((text, *sources))).hexdigest()[:32] + "}"

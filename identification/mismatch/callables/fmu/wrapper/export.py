"""Wrapper file: the wrapped FMU and a library of its effects for this platform."""

import hashlib
import platform
import zipfile
from pathlib import Path
from tempfile import TemporaryDirectory

from slipbench.identification.mismatch.callables.fmu.wrapper.description import (
    IDENTIFIER,
    description,
)
from slipbench.identification.mismatch.callables.fmu.wrapper.sides import Sides
from slipbench.identification.mismatch.callables.fmu.wrapper.tables import tables
from slipbench.identification.mismatch.systems.effects.library import CODES
from slipbench.identification.mismatch.systems.kernel import TYPES, effects_texts, place_text
from slipbench.plant.fmu.kernel_object import called_from_c, object_of
from slipbench.plant.fmu.library import SUFFIXES, binary_folder, link

SOURCES = Path(__file__).parent / "c"
SYMBOL = "slipbench_at"
INNER = "resources/inner"


def write_wrapper(path: Path, sides: Sides, headers: Path) -> None:
    """Write an FMU for co-simulation, of the same FMI version as the wrapped FMU.

    headers: folder of the FMI header files. Raises PlantError where there is no compiler,
    InputError where the platform is not supported, OSError where the file cannot be written.
    """
    plan = sides.opened.plan
    version = int(plan.fmu.version[0])
    folder, text = binary_folder(version), effects_text(sides)
    token = _token(tables(sides, ""), text, plan.fmu.path)
    names = ("wrapper.c", "effects.c", f"fmi{version}.c", f"absent{version}.c")
    with TemporaryDirectory(prefix="slipbench-fmu-") as name:
        work = Path(name)
        (work / "tables.h").write_text(tables(sides, token), encoding="utf-8")
        (work / "kernel.o").write_bytes(object_of(text, SYMBOL))
        library = link([SOURCES / one for one in names], work, headers)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("modelDescription.xml", description(sides, token))
        packed.writestr(f"binaries/{folder}/{IDENTIFIER}{SUFFIXES[platform.system()]}", library)
        inner = plan.fmu.folder
        for file in sorted(f for f in inner.rglob("*") if f.is_file()):
            packed.write(file, f"{INNER}/{file.relative_to(inner).as_posix()}")


def effects_text(sides: Sides) -> str:
    """Return the source text of the function that applies the effects of this wrapper."""
    kinds = {e.name: type(e) for e in sides.acting if e.act is not None}
    ordered = [kinds[name] for name in sorted(kinds, key=CODES.__getitem__)]
    kernel_function = called_from_c(place_text(SYMBOL, ordered), "AT")
    return "\n".join((TYPES, *effects_texts(ordered), kernel_function))


def _token(header: str, text: str, inner: Path) -> str:
    """Return the token of the wrapper, a hash of its effects, parameters and wrapped FMU."""
    sources = [file.read_bytes() for file in sorted(SOURCES.iterdir())]
    parts = (header.encode(), text.encode(), inner.read_bytes(), *sources)
    return "{" + hashlib.sha256(b"\n".join(parts)).hexdigest()[:32] + "}"

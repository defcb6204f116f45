"""The shared library of an FMU: the kernel's object file and a few C sources, linked by a compiler."""

import platform
import shutil
import subprocess
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from slipbench.plant.errors import PlantError

SOURCES = Path(__file__).parent / "c"
COMPILERS = ("cc", "gcc", "clang")
SUFFIXES = {"Linux": ".so", "Darwin": ".dylib"}
FOLDERS = {
    ("Linux", 2): "linux64",
    ("Darwin", 2): "darwin64",
    ("Linux", 3): f"{platform.machine()}-linux",
    ("Darwin", 3): f"{platform.machine().replace('arm64', 'aarch64')}-darwin",
}
FLAGS = ("-std=c11", "-O2", "-shared", "-fPIC", "-fvisibility=default", "-ffp-contract=off")


def compiler() -> tuple[str, ...]:
    """Return the command of a C compiler. Raises PlantError where there is none."""
    for name in COMPILERS:
        if found := shutil.which(name):
            return (found,)
    if find_spec("ziglang") is not None:  # a compiler that pip installs
        return (sys.executable, "-m", "ziglang", "cc")
    raise PlantError(
        "an FMU is linked by a C compiler, and there is none",
        "export-fmu",
        f"one of {', '.join(COMPILERS)} in PATH",
        "none of them",
        "install one (Debian: apt install gcc; macOS: xcode-select --install), or pip install ziglang",
    )


def binary_folder(version: int) -> str:
    """Return the name of the folder for binaries of this platform. Raises PlantError."""
    key = (platform.system(), version)
    if key not in FOLDERS:
        raise PlantError(
            "an FMU is exported for the platform on which this runs, and this one is not supported",
            "export-fmu",
            " or ".join(SUFFIXES),
            platform.system(),
            "export it there",
        )
    return FOLDERS[key]


def link(sources: Sequence[Path], work: Path, headers: Path) -> bytes:
    """Compile and link a library; returns its content. Raises PlantError with the compiler's words.

    work: folder that holds kernel.o and tables.h. headers: folder of the header files of FMI.
    """
    library = work / f"library{SUFFIXES[platform.system()]}"
    folders = (work, sources[0].parent, headers)
    command: list[str | Path] = [*compiler(), *FLAGS, *(f"-I{f}" for f in folders), *sources]
    command += [work / "kernel.o", "-o", library, "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise PlantError(
            "the C compiler failed",
            "export-fmu",
            "a compiler that makes shared libraries for this platform",
            done.stderr.strip()[-2000:] or f"exit status {done.returncode}",
            f"check it: {command[0]} --version",
        )
    return library.read_bytes()

"""Newer processors have more registers than Debian's user-mode Linux expects; see the C file."""

import shutil
import subprocess
from pathlib import Path

SOURCE = Path(__file__).with_name("wide_registers.c")
TOO_WIDE = {"amx_tile", "apx"}  # processor flags


def needed() -> bool:
    """Tell whether user-mode Linux would fail on this processor."""
    text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    return any(TOO_WIDE & set(line.split()) for line in text.splitlines() if "flags" in line)


def missing() -> str:
    """Say which package is needed, if any."""
    return "gcc libc6-dev" if needed() and shutil.which("gcc") is None else ""


def preload(box: Path) -> dict[str, str]:
    """Give the environment in which user-mode Linux runs here; what it needs is built in `box`."""
    if not needed():
        return {}
    library = box / "wide_registers.so"
    subprocess.run(["gcc", "-shared", "-fPIC", "-O2", "-o", library, SOURCE], check=True)
    return {"LD_PRELOAD": str(library)}

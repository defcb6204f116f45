"""Two small libraries that user-mode Linux is started with; their C files say what for."""

import os
import subprocess
from pathlib import Path

NAMES = ("wide_registers", "slow_motion")


def preload(box: Path, slow: int) -> dict[str, str]:
    """Build the libraries in `box`; the environment in which time passes `slow` times slower."""
    libraries = [_built(name, box) for name in NAMES]
    return {"LD_PRELOAD": ":".join(map(str, libraries)), "SLOW_MOTION": str(slow)}


def _built(name: str, box: Path) -> Path:
    source, library = Path(__file__).with_name(f"{name}.c"), box / f"{name}.so"
    warnings = ("-Wall", "-Wextra", "-Werror")
    subprocess.run(
        ["gcc", "-shared", "-fPIC", "-O2", *warnings, "-o", library, source, "-ldl"],
        check=True, env={"PATH": os.environ.get("PATH", os.defpath), "LC_ALL": "C"},
    )  # fmt: skip
    return library

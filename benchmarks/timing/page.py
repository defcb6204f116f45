"""Page of the benchmarks of time and formats: machine, versions, and what each printed.

`python -m timing.page` in benchmarks/ prints the page.
"""

import os
import platform
import subprocess
import sys
import time
from importlib import metadata
from pathlib import Path

BENCHMARKS = Path(__file__).parents[1]
PAGES = {
    "lateness.py": "Lateness: periodic loop, replay, response to the button",
    "bindings.py": "Tick cost and lateness before and after binding files",
    "decode.py": "Decoding a whole log",
    "export.py": "Exporting a recording",
    "view.py": "A trial with and without the live view",
}
QUIET = 0.5  # load average of an idle machine
LIBRARIES = ("python-can", "cantools", "asammdf", "hilspy", "numpy")


def main() -> None:
    """Run the benchmarks and print the page."""
    print(
        "# Benchmarks\n\nWritten by `make bench-page`. slipbench and other programs are measured in the same run, on one machine.\n"
    )
    print(f"{_machine()}\n\n{_how_quiet(os.getloadavg()[0])}\n")
    for name, title in PAGES.items():
        done = subprocess.run(
            [sys.executable, str(BENCHMARKS / name)], capture_output=True, text=True, check=True
        )
        print(f"## {title}\n\n```text\n{done.stdout.rstrip()}\n```\n")


def _how_quiet(load: float) -> str:
    """Sentence on the load of the machine before the run."""
    if load < QUIET:
        return f"No other load (load average {load:.2f} before the run)."
    return (
        f"Other programs were running (load average {load:.2f} before the run): the figures are worse"
        " than on an idle machine. Programs compared in one run had the same load."
    )


def _machine() -> str:
    versions = ", ".join(f"{name} {_version(name)}" for name in LIBRARIES)
    return (
        f"{time.strftime('%Y-%m-%d')}, {os.cpu_count()} processors, {platform.system()}"
        f" {platform.release().split('-')[0]}, Python {platform.python_version()}, {versions}."
    )


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"


if __name__ == "__main__":
    main()

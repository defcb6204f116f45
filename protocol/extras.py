"""Libraries that an extra of slipbench installs: imported where they are used, named where absent.

The base installation runs trials, replays logs and identifies recordings. Which extra holds which
library stands here and in pyproject.toml; tests/test_package.py compares the two.
"""

from importlib import import_module
from types import ModuleType

from slipbench.protocol.errors import InputError

EXTRA_OF = {
    "duckdb": "analysis",
    "pyarrow": "analysis",
    "pandas": "analysis",
    "xarray": "analysis",
    "asammdf": "mdf",
    "mcap": "mdf",
    "gpxpy": "logs",
    "fitdecode": "logs",
    "libxrk": "logs",
    "rosbags": "logs",
    "dask": "cluster",
    "distributed": "cluster",
    "slycot": "robust",
    "foxglove": "foxglove",
    "lupa": "ecu",
    "fmpy": "fmu",
    "mujoco": "mujoco",
    "starlette": "view",
    "textual": "view",
    "uvicorn": "view",
    "websockets": "view",
}


def optional_library(name: str) -> ModuleType:
    """Import a library, or a module of one, that an extra of slipbench installs.

    name: as in an import statement, "pyarrow" or "mcap.writer". Raises InputError, with the
    command that installs it, where the library is absent or cannot be imported.
    """
    library = name.partition(".")[0]
    try:
        return import_module(name)
    except ImportError as cause:
        raise InputError(
            f"this needs {library}, which is not installed",
            found=str(cause),
            remedy=install_command(library),
        ) from cause


def install_command(library: str) -> str:
    """Return the shell command that installs a library of EXTRA_OF.

    Raises KeyError where no extra holds the library.
    """
    return f"pip install 'slipbench[{EXTRA_OF[library]}]'"

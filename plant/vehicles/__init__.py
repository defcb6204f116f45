"""Vehicle files that come with the plant."""

from importlib.resources import files
from pathlib import Path

FOLDER = Path(str(files(__name__)))


def builtin_vehicle(name: str) -> Path:
    """The path of a vehicle file of this folder: 'nominal' or 'demonstration'."""
    return FOLDER / f"{name}.toml"


NOMINAL = builtin_vehicle("nominal")
DEMONSTRATION = builtin_vehicle("demonstration")

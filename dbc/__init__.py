"""What is on the wire: the CAN databases of the bench, as data."""

from importlib.resources import files
from pathlib import Path

FOLDER = Path(str(files(__name__)))
MOTORBIKE = FOLDER / "motorbike.dbc"
MOTORBIKE_FD = FOLDER / "motorbike_fd.dbc"
MOTORBIKE_ROLES = FOLDER / "motorbike_roles.toml"

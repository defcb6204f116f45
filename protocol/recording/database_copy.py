"""Copy of the database in a run folder, under the file-name ending of its format.

    database.dbc, database.arxml, database.kcd, database.sym

Other tools choose their parser by the ending. Reading goes by content, so a copy under another of
these endings is read as well.
"""

import os
import shutil
from pathlib import Path

from slipbench.protocol.database.database import file_format
from slipbench.protocol.errors import InputError

DATABASE = (
    "database.dbc"  # a DBC file's name, and the one that a missing database is reported under
)
FORMATS = ("dbc", "arxml", "kcd", "sym")


def copy_database(path: Path, folder: Path) -> Path:
    """Copy of a database in a run folder. Raises InputError where the file cannot be read."""
    return Path(shutil.copyfile(path, folder / f"database.{file_format(path)}"))


def find_database(folder: Path) -> Path:
    """Path of the database in a run folder; `DATABASE` where there is none.

    Raises InputError where there are several: which one belongs to the frames is unknown.
    """
    paths = [folder / f"database.{form}" for form in FORMATS]
    found = [path for path in paths if os.path.lexists(path)]
    if len(found) > 1:
        raise InputError(
            "a recording has one database",
            where=str(folder),
            found=", ".join(path.name for path in found),
            remedy="in a copy of the recording, keep the one that belongs to the frames",
        )
    return found[0] if found else folder / DATABASE

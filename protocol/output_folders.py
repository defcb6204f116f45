"""Folders for results: all that a command needs, or none."""

import os
from errno import EACCES, ENOTDIR
from pathlib import Path


def make_folders(*folders: Path) -> None:
    """Make all of these folders with their parents, or none. Raises OSError.

    Folders that are there already stay as they are, but must be writable.
    """
    made: list[Path] = []
    try:
        for folder in folders:
            missing = [path for path in (folder, *folder.parents) if not path.exists()]
            for path in reversed(missing):
                path.mkdir()
                made.append(path)
            _check_writable(folder)
    except OSError:
        for path in reversed(made):
            path.rmdir()
        raise


def _check_writable(folder: Path) -> None:
    if not folder.is_dir():
        raise NotADirectoryError(ENOTDIR, os.strerror(ENOTDIR), str(folder))
    if not os.access(folder, os.W_OK):
        raise PermissionError(EACCES, os.strerror(EACCES), str(folder))

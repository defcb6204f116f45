"""Folders for results: all that a command needs, or none."""

import os
from contextlib import suppress
from errno import EACCES, EISDIR, ENOTDIR
from pathlib import Path

FIGURES = "figures"
"""Folder of a page's figures, beside the page."""


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


def check_page(page: Path) -> None:
    """Check before the work that a page, and figures beside it, can be written. Raises OSError.

    Nothing is made.
    """
    folder = page.absolute().parent / FIGURES
    there = next(path for path in (folder, *folder.parents) if path.exists())
    for path in (page, there / page.name):  # a loop of links, a name that is too long
        with suppress(FileNotFoundError):
            path.stat()
    if page.is_dir():
        raise IsADirectoryError(EISDIR, os.strerror(EISDIR), str(page))
    _check_writable(there)


def _check_writable(folder: Path) -> None:
    if not folder.is_dir():
        raise NotADirectoryError(ENOTDIR, os.strerror(ENOTDIR), str(folder))
    if not os.access(folder, os.W_OK):
        raise PermissionError(EACCES, os.strerror(EACCES), str(folder))

"""Write a new file or folder: whole or not at all, and never over an existing one."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from slipbench.protocol.errors import InputError
from slipbench.protocol.user_file import is_folder


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Path of a draft beside `path`; it becomes `path` when the block ends without an exception.

    The parent folders are made. Raises InputError where `path` exists, is no possible name, or
    cannot be written; no draft is left behind.
    """
    refuse_existing(path)
    draft = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _remove(draft)  # of a process that was killed
        yield draft
        draft.replace(path)
    except OSError as cause:
        raise InputError(
            "cannot be written",
            where=str(path),
            found=str(cause),
            remedy="give a path in a folder that you may write to",
        ) from cause
    finally:
        _remove(draft)


def refuse_existing(path: Path) -> None:
    """Check that a new file may be written. Raises InputError where `path` exists or is no name."""
    if "\0" in str(path) or not path.name:
        raise InputError("this is no name for a new file", where=repr(str(path)))
    if os.path.lexists(path):
        raise InputError(
            "it exists, and nothing is overwritten",
            where=str(path),
            remedy="give another name, or remove it yourself",
        )


def _remove(draft: Path) -> None:
    if is_folder(draft) and not draft.is_symlink():
        shutil.rmtree(draft)
    elif os.path.lexists(draft):  # False for an impossible name
        draft.unlink()

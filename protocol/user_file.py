"""Open files that a user names: regular files only, never more than stated is read.

A device such as /dev/zero has no end and a FIFO waits for a writer, so neither is ever read. The
file is opened first and examined then, without waiting, so that a name cannot change its meaning
in between.
"""

import os
import stat
from io import BufferedReader
from pathlib import Path

from slipbench.protocol.errors import InputError

PIECE = 1 << 20  # bytes read at once

_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFIFO: "a FIFO",
    stat.S_IFSOCK: "a socket",
}


def open_user_file(path: Path) -> BufferedReader:
    """Regular file at `path`, opened for reading bytes.

    Raises InputError where there is none: a missing file, a folder, a device, a FIFO, a loop of
    links, a name that the system does not accept, or a file without the right to read it.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except FileNotFoundError as cause:
        raise InputError("no such file", where=str(path), remedy="check the path") from cause
    except (OSError, ValueError) as cause:  # ValueError: a NUL character in the name
        if kind := _kind_at(path):
            raise _not_a_file(path, kind) from cause
        raise InputError("cannot be read", where=_shown(path), found=str(cause)) from cause
    mode = stat.S_IFMT(os.fstat(descriptor).st_mode)
    if mode != stat.S_IFREG:
        os.close(descriptor)
        raise _not_a_file(path, _KINDS.get(mode, "no regular file"))
    return os.fdopen(descriptor, "rb")


def read_user_file(path: Path, largest: int) -> bytes:
    """Content of the regular file at `path`, at most `largest` bytes. Raises InputError."""
    with open_user_file(path) as file:
        content = read_at_most(file, largest)
    if content is None:
        raise InputError(
            "the file is too large",
            where=str(path),
            expected=f"at most {largest:,} bytes",
            found=f"{path.stat().st_size:,} bytes",
            remedy="check that it is the right file",
        )
    return content


def read_at_most(file: BufferedReader, largest: int) -> bytes | None:
    """Rest of an open file, read piece by piece; None where it is longer than `largest` bytes.

    Raises InputError where the system cannot read it (a damaged disk, files of /proc).
    """
    pieces, total = [], 0
    try:
        while piece := file.read(PIECE):
            pieces.append(piece)
            total += len(piece)
            if total > largest:
                return None
    except OSError as cause:
        raise InputError("cannot be read", where=str(file.name), found=str(cause)) from cause
    return b"".join(pieces)


def is_folder(path: Path) -> bool:
    """Whether `path` is a folder; False, too, for a name that no folder can have."""
    return _kind_at(path) == _KINDS[stat.S_IFDIR]


def _kind_at(path: Path) -> str:
    """Kind of what is at `path` if it is no regular file; a socket, for one, cannot be opened."""
    try:
        return _KINDS.get(stat.S_IFMT(path.stat().st_mode), "")
    except (OSError, ValueError):
        return ""


def _not_a_file(path: Path, kind: str) -> InputError:
    return InputError(
        f"this is {kind}, not a file",
        where=_shown(path),
        expected="a regular file",
        remedy="name a file in it" if kind == "a folder" else "save its data in a file first",
    )


def _shown(path: Path) -> str:
    text = str(path).encode("unicode_escape").decode("ascii") if "\0" in str(path) else str(path)
    return text if len(text) <= 200 else text[:200] + "..."

"""Check the containers of a BLF file: zlib packs a gigabyte of zeros into a megabyte.

python-can unpacks each as a whole, whatever comes out. So before it reads a file, this unpacks the
containers bit by bit and throws away what comes out: it only looks whether that ends in time.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.unpacking import LARGEST, fits
from slipbench.protocol.user_file import open_user_file

FILE = struct.Struct("<4sL")  # "LOGG", and the size of the file's own header
OBJECT = struct.Struct("<4sHHLL")  # "LOBJ", header size and version, size, kind
CONTAINER = struct.Struct("<H6xL4x")  # how it is packed, and the size that it says it has unpacked
A_CONTAINER, ZLIB = 10, 2


def check_containers(path: Path) -> None:
    """Check a BLF file. Raises InputError where an object is larger than any logger makes it.

    Other damage is left to the reader, which names it.
    """
    with open_user_file(path) as file:
        for at, kind, size in _objects(file):
            if not OBJECT.size <= size <= LARGEST:
                raise _too_large(path, at, f"{size} bytes")
            if kind == A_CONTAINER and not _ends(file.read(size - OBJECT.size)):
                raise _too_large(path, at, f"more than {LARGEST} bytes when unpacked")


def _objects(file: BinaryIO) -> Iterator[tuple[int, int, int]]:
    """Position, kind and size of every object; the file is then read from behind its header."""
    head = file.read(FILE.size)
    at = FILE.unpack(head)[1] if len(head) == FILE.size else 0
    while at:
        file.seek(at)
        if len(head := file.read(OBJECT.size)) < OBJECT.size:
            return
        mark, _, _, size, kind = OBJECT.unpack(head)
        if mark != b"LOBJ":
            return
        yield at, kind, size
        at += size + size % 4


def _ends(container: bytes) -> bool:
    """Whether the unpacked content of a container is no larger than allowed."""
    if len(container) < CONTAINER.size or CONTAINER.unpack_from(container)[0] != ZLIB:
        return True
    return fits(container[CONTAINER.size :], LARGEST)


def _too_large(path: Path, at: int, found: str) -> InputError:
    return InputError(
        "an object of this BLF file is larger than a logger makes them",
        where=f"{path}, byte {at}",
        expected=f"{OBJECT.size} to {LARGEST} bytes, packed or not",
        found=found,
        remedy="the file is damaged, or made to fill the memory: take a copy, or another export",
    )

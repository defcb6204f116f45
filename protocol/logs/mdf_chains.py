"""Blocks of an ASAM MDF file form linked lists; in a damaged file such a list can be a cycle.

asammdf follows a cycle for ever, and its memory grows. So before it opens a file, this
walks the chains that it will walk, of MDF 4 (ASAM MDF 4.2, its blocks and links) and of MDF 3. On
the way it looks whether a packed block unpacks to more than any logger packs into one.
"""

import os
import struct
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.unpacking import LARGEST, fits
from slipbench.protocol.user_file import open_user_file

FIRST = 64  # the address of the header block, after the identification block
VERSION_AT = 8  # the version's text: "4.10"

# Links, by their number, to the next block of a chain, to the first of one that hangs below, and
# to data that may be a list.
CHAINS_4 = {
    b"##HD": (0, 1, 2, 3, 4),
    b"##DG": (0, 1, 2),
    b"##CG": (0, 1, 4),
    b"##CN": (0, 1, 5),
    b"##CA": (0,),
    b"##FH": (0,),
    b"##CH": (0, 1),
    b"##AT": (0,),
    b"##EV": (0,),
    b"##SR": (0, 1),
    b"##DL": (0,),
    b"##LD": (0,),
    b"##HL": (0,),
    b"##DZ": (),
}
CHAINS_3 = {b"HD": (0,), b"DG": (0, 1), b"CG": (0, 1), b"CN": (0,)}
# What a channel points to as its data may also be another channel, or group, of the tree.
DATA, OF_DATA = 5, {b"##DL", b"##LD", b"##HL", b"##DZ"}
PACKED = struct.Struct("<24x2sBxIQQ")  # a DZ block: of what, how, sizes unpacked and packed
LISTS = {b"##DL", b"##LD"}
DEFLATED = (0, 1)  # as it is, and transposed before


@dataclass(frozen=True)
class _Form:
    """How blocks of one version of the format look."""

    head: struct.Struct  # up to the links; its first field is the block's kind
    link: struct.Struct
    chains: Mapping[bytes, tuple[int, ...]]


_FOUR = _Form(struct.Struct("<4s20x"), struct.Struct("<Q"), CHAINS_4)
_THREE = _Form(struct.Struct("<2s2x"), struct.Struct("<I"), CHAINS_3)


def check_chains(path: Path) -> None:
    """Raise InputError where a block of the MDF file `path` is reached twice."""
    with open_user_file(path) as file:
        form = _form(file.read(FIRST))
        visited: set[int] = set()
        waiting = [FIRST]
        while waiting:
            address = waiting.pop()
            if address in visited:
                raise InputError(
                    "the blocks of this file go round in a circle",
                    where=str(path),
                    expected="each block reached once",
                    found=f"the one at {address:#x} twice",
                    remedy="the file is damaged: repair it with the logger's own program, or take"
                    " a copy",
                )
            visited.add(address)
            if not _unpacks(file, address, form):
                raise InputError(
                    "a packed block of this file is larger than a logger makes them",
                    where=f"{path}, byte {address}",
                    expected=f"at most {LARGEST} bytes, packed or not",
                    remedy="the file is damaged, or made to fill the memory: take a copy",
                )
            waiting += _followed(file, address, form)


def _form(identification: bytes) -> _Form:
    """Tell the version by the text that asammdf goes by; what is no MDF at all is its to refuse."""
    return _THREE if identification[VERSION_AT : VERSION_AT + 1] in (b"2", b"3") else _FOUR


def _followed(file: BinaryIO, address: int, form: _Form) -> Iterator[int]:
    """Give the addresses that a block's chains lead to; none where there is no such block."""
    size = form.link.size
    for number in _numbers(file, address, form):
        file.seek(address + form.head.size + number * size)
        if len(link := file.read(size)) < size:
            return
        (target,) = form.link.unpack(link)
        found = _kind(file, target, form)
        if found in form.chains and (number != DATA or found in OF_DATA):
            yield target


def _numbers(file: BinaryIO, address: int, form: _Form) -> Iterable[int]:
    """Give the numbers of the links to follow; all of them of a list of data."""
    kind = _kind(file, address, form)
    if kind not in LISTS:
        return form.chains.get(kind, ())
    file.seek(address + form.head.size - form.link.size)
    (count,) = form.link.unpack(file.read(form.link.size))
    return range(min(count, os.fstat(file.fileno()).st_size // form.link.size))


def _unpacks(file: BinaryIO, address: int, form: _Form) -> bool:
    """Tell whether a block, where it is a packed one, has a size that a logger gives it."""
    if _kind(file, address, form) != b"##DZ":
        return True
    file.seek(address)
    head = file.read(PACKED.size)
    if len(head) < PACKED.size:
        return True  # asammdf names it
    _, how, _, unpacked, packed = PACKED.unpack(head)
    if max(unpacked, packed) > LARGEST:
        return False
    return how not in DEFLATED or fits(file.read(packed), LARGEST)


def _kind(file: BinaryIO, address: int, form: _Form) -> bytes:
    """Give the kind of the block at an address; empty where the file has none there."""
    if not 0 < address < os.fstat(file.fileno()).st_size:
        return b""
    file.seek(address)
    head = file.read(form.head.size)
    return bytes(form.head.unpack(head)[0]) if len(head) == form.head.size else b""

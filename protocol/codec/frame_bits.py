"""Number of bits of every frame of a log on the wire, with the exact number of stuff bits.

The rules and their tables are in `protocol/codec/bit_stuffing.py`; here they act on columns.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.protocol.codec.bit_stuffing import (
    CLASSIC_TAIL,
    DLC,
    FD_TAIL,
    START,
    crc15_table,
    stuffing_steps,
)
from slipbench.protocol.logs.frame_log import FrameLog

IntArray = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.uint8]
Pieces = list[tuple[npt.NDArray[Any], int]]  # bits of n frames, and how many bits


@dataclass(frozen=True)
class FrameBits:
    """Bits of n frames, (n,) each: at the nominal rate, and at the data rate (0 in classic CAN)."""

    nominal: IntArray
    data: IntArray


def frame_bits(log: FrameLog) -> FrameBits:
    """Exact bits of every frame of a log. CAN FD frames are taken to switch their rate (BRS)."""
    nominal, fast = np.zeros(len(log), np.int64), np.zeros(len(log), np.int64)
    shape = log.length.astype(np.int64) * 4 + log.extended * 2 + log.fd
    for kind in np.unique(shape).tolist():
        rows = np.flatnonzero(shape == kind)
        length, extended, fd = kind // 4, bool(kind & 2), bool(kind & 1)
        payload = np.ascontiguousarray(log.data[rows, :length].T)
        identifier = log.identifier[rows].astype(np.int64)
        if fd:
            nominal[rows], fast[rows] = _fd(identifier, extended, payload)
        else:
            nominal[rows] = _classic(identifier, extended, payload)
    return FrameBits(nominal, fast)


def _classic(identifier: IntArray, extended: bool, payload: Bytes) -> IntArray:
    length = len(payload)
    header = _arbitration(identifier, extended) << 7 | min(length, 8)  # RTR or IDE, r1, r0, DLC
    size = 39 if extended else 19
    parts = [*_pieces(header, size), *((column, 8) for column in payload)]
    crc = _crc15(parts)
    stuffed, _ = _stuff([*parts, *_pieces(crc, 15)], identifier.size)
    return stuffed + size + 8 * length + 15 + CLASSIC_TAIL


def _fd(identifier: IntArray, extended: bool, payload: Bytes) -> tuple[IntArray, IntArray]:
    length = len(payload)
    # RRS (and IDE) 0, FDF 1, res 0, BRS 1; then at the data rate ESI 0 and DLC
    slow = _arbitration(identifier, extended) << (4 if extended else 5) | 0b101
    slow_size = 36 if extended else 17
    control = np.full(identifier.size, DLC[length], np.int64)
    first, state = _stuff(_pieces(slow, slow_size), identifier.size)
    parts = [*_pieces(control, 5), *((column, 8) for column in payload)]
    second, state = _stuff(parts, identifier.size, state)
    last_bit = (parts[-1][0] & 1).astype(np.int64)
    second -= (state >> 2) != last_bit  # there the fixed stuff bit takes the place of this one
    crc, fixed = (17, 6) if length <= 16 else (21, 7)
    return first + slow_size + FD_TAIL, second + 5 + 8 * length + 4 + crc + fixed


def _arbitration(identifier: IntArray, extended: bool) -> IntArray:
    """Start of frame (0) and identifier; an extended one with SRR and IDE between its parts."""
    if not extended:
        return identifier
    return (identifier >> 18) << 20 | 0b11 << 18 | identifier & 0x3FFFF


def _pieces(value: IntArray, size: int) -> Pieces:
    """Cut `size` bits into bytes from the end; the remaining bits come first."""
    head = size % 8
    widths = ([head] if head else []) + [8] * (size // 8)
    pieces: Pieces = []
    remaining = size
    for width in widths:
        remaining -= width
        pieces.append((value >> remaining & (1 << width) - 1, width))
    return pieces


def _crc15(parts: Pieces) -> IntArray:
    """CRC-15 of CAN over whole bytes; the zeros before a short first piece do not change it."""
    crc = np.zeros(parts[0][0].size, np.int64)
    for piece, _ in parts:
        crc = (crc << 8 & 0x7FFF) ^ _crc_table()[crc >> 7 ^ piece]
    return crc


@cache
def _crc_table() -> IntArray:
    return np.array(crc15_table(), np.int64)


def _stuff(parts: Pieces, n: int, state: IntArray | None = None) -> tuple[IntArray, IntArray]:
    """Count stuff bits; returns them and the state at the end (see `stuffing_steps`)."""
    now = np.full(n, START, np.int64) if state is None else state
    count = np.zeros(n, np.int64)
    for piece, width in parts:
        step = _steps(width)[now << width | piece]
        count += step >> 3
        now = step & 7
    return count, now


@cache
def _steps(width: int) -> IntArray:
    return np.array(stuffing_steps(width), np.int64)

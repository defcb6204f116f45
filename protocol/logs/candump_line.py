"""One line of candump text: what `candump -L` writes and `canplayer` reads.

    (1631416514.717133) can0 0D2#0000FFFF10000000       classic frame, standard identifier
    (1631416514.717133) can0 18FEF100#FFFF T            extended identifier, sent by the logger
    (1631416514.717133) can1 123##1DEADBEEF             CAN FD, flags 1 (bit-rate switch)
    (1631416514.717133) can0 123#R8                     remote frame
    (1631416514.717133) can0 20000088#0000000000000000  error frame (0x20000000 marks it)

Seconds have up to nine decimals. An identifier has three digits (standard) or eight (extended).
"""

import re
from collections.abc import Iterator

import numpy as np

from slipbench.protocol.logs.frame_log import FrameLog

ERROR_FLAG = 0x2000_0000
IDENTIFIER_MASK = 0x1FFF_FFFF
LATEST_SECOND = 9_223_372_035  # beyond it, ns overflow 64 bits

LINE = re.compile(
    rb"\s*\((?P<seconds>\d{1,10})\.(?P<fraction>\d{1,9})\)\s+(?P<bus>[^\s()#]{1,32})\s+"
    rb"(?P<identifier>[0-9A-Fa-f]{8}|[0-7][0-9A-Fa-f]{2})#"
    rb"(?:(?P<remote>[Rr][0-9A-Fa-f]?(?:_[9A-Fa-f])?)"
    rb"|#(?P<flags>[0-9A-Fa-f])(?P<fd>(?:[0-9A-Fa-f]{2}){0,64})"
    rb"|(?P<classic>(?:[0-9A-Fa-f]{2}){0,8})(?:_[9A-Fa-f])?)"
    rb"(?:\s+(?P<direction>[RTrt]))?\s*"
)

EXPECTED = '"(seconds.decimals) bus identifier#data", as in "(12.345678) can0 123#DEADBEEF"'


def format_line(
    time_ns: int,
    bus: str,
    identifier: int,
    data: bytes,
    *,
    extended: bool = False,
    fd_flags: int | None = None,
    sent: bool = False,
) -> bytes:
    """One data frame as a line, line end included; with `fd_flags`, a CAN FD frame. time_ns: ns."""
    head = f"({stamp(time_ns)}) {bus} {identifier:0{8 if extended else 3}X}#"
    flags = "" if fd_flags is None else f"#{fd_flags:X}"
    return f"{head}{flags}{data.hex().upper()}{' T' if sent else ''}\n".encode("ascii")


def stamp(time_ns: int) -> str:
    """A time in ns as text in s: six decimals, or nine where six would lose digits."""
    seconds, fraction = divmod(time_ns, 1_000_000_000)
    if fraction % 1000:
        return f"{seconds}.{fraction:09d}"
    return f"{seconds}.{fraction // 1000:06d}"


def format_frames(frames: FrameLog) -> Iterator[bytes]:
    """Every frame as a line, in their order."""
    flags = np.zeros(len(frames), np.uint8) if frames.fd_flags is None else frames.fd_flags
    payload, width = frames.data.tobytes(), frames.data.shape[1]
    columns = (
        frames.time_ns,
        frames.bus,
        frames.identifier,
        frames.length,
        frames.extended,
        frames.fd,
        flags,
        frames.sent,
    )
    for row, (time_ns, bus, identifier, length, extended, fd, flag, sent) in enumerate(
        zip(*(column.tolist() for column in columns), strict=True)
    ):
        yield format_line(
            time_ns,
            frames.buses[bus],
            identifier,
            payload[row * width : row * width + length],
            extended=extended,
            fd_flags=flag if fd else None,
            sent=sent,
        )

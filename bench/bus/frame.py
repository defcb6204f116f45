"""Frame on the wire: its priority in arbitration and its duration."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from slipbench.protocol.codec.bit_stuffing import DLC, classic_bits, fd_bits

INTERMISSION = 3  # bits of silence that end every frame
END_OF_FRAME = 7


class Frame(NamedTuple):
    """One data or remote frame.

    requested      payload bytes that a remote frame requests; None for a data frame
    switches_rate  its payload is sent at the data rate (BRS); CAN FD only
    error_passive  error state indicator of its sender (ESI); CAN FD only
    """

    identifier: int
    data: bytes
    extended: bool = False
    fd: bool = False
    switches_rate: bool = False
    error_passive: bool = False
    requested: int | None = None

    @property
    def priority(self) -> int:
        """Arbitration bits as a number; the lowest wins (ISO 11898-1).

        Base identifier, RTR or SRR, IDE, identifier extension, RTR: a data frame wins against a
        remote frame, and a standard identifier against an extended one that begins with it.
        """
        remote = self.requested is not None
        if self.extended:
            base, extension = self.identifier >> 18, self.identifier & 0x3FFFF
            return base << 21 | 0b11 << 19 | extension << 1 | remote
        return self.identifier << 21 | remote << 20

    @property
    def after_arbitration(self) -> tuple[bool, int, bytes]:
        """Content after arbitration; of two frames with one identifier the lower is dominant."""
        length = len(self.data) if self.requested is None else self.requested
        return self.fd, length, self.data


def checked(frame: Frame) -> Frame:
    """The frame itself. Raises ValueError where no CAN controller can send it."""
    highest = 0x1FFF_FFFF if frame.extended else 0x7FF
    if not 0 <= frame.identifier <= highest:
        raise ValueError(f"identifier {frame.identifier:#x} is above {highest:#x}")
    if frame.fd and (len(frame.data) not in DLC or frame.requested is not None):
        raise ValueError(f"CAN FD has no remote frames, and none with {len(frame.data)} bytes")
    if not frame.fd and max(len(frame.data), frame.requested or 0) > 8:
        raise ValueError("a classic frame has at most 8 bytes")
    return frame


@dataclass(frozen=True)
class BitRates:
    """Bit rates of a bus, bit/s; the data rate is that of CAN FD frames after their rate switch."""

    nominal: int = 1_000_000
    data: int = 2_000_000

    @cached_property
    def bit(self) -> float:
        """Duration of a bit at the nominal rate, ns."""
        return 1e9 / self.nominal

    def duration(self, frame: Frame) -> float:
        """Duration of a frame with its intermission, ns."""
        if not frame.fd:
            bits = classic_bits(frame.identifier, frame.extended, frame.data, frame.requested)
            return bits * 1e9 / self.nominal
        slow, fast = fd_bits(
            frame.identifier, frame.extended, frame.data, frame.switches_rate, frame.error_passive
        )
        return slow * 1e9 / self.nominal + fast * 1e9 / self.data

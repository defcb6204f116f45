"""What an FMU sends and reads on CAN: frames, the variables in them, and their protection."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from math import gcd

TIME = "time"
"""Stands for a variable: the time since the start."""
HEADER_BYTES, SPARE_BYTES = 17, 4096
"""Of the longest operation around a payload; and for configuration and format errors."""
PLAIN = 16
"""Stands for an E2E profile: a counter and a checksum without one."""


@dataclass(frozen=True)
class BusSignal:
    """One signal of a frame: value in SI = raw * scale + offset.

    name: "Message.signal". variable: of the FMU, or TIME; "": always the raw value `fixed`. bits:
    positions in the payload, the lowest of the signal first, 8 * byte + n, n = 0 the byte's lowest.
    real: a floating-point number of 32 or 64 bits. wraps: sent modulo its width. low, high: raw
    values to which a sent signal is limited.
    """

    name: str
    bits: tuple[int, ...]
    variable: str = ""
    scale: float = 1.0
    offset: float = 0.0
    signed: bool = False
    real: bool = False
    wraps: bool = False
    low: float = 0.0
    high: float = 0.0
    fixed: int = 0


@dataclass(frozen=True)
class BusProtection:
    """Counter and checksum of a frame.

    profile: AUTOSAR E2E profile 1, 2 or 5, or PLAIN. data_ids: of the profile, its bytes. counter:
    positions of the bits of a plain counter, the lowest first; period: its number of values. place:
    byte of a plain checksum, -1 where there is none; kind, polynomial, start, final_xor: see
    `slipbench.protocol.codec.checksum`.
    """

    profile: int
    period: int
    data_ids: bytes = b""
    counter: tuple[int, ...] = ()
    place: int = -1
    kind: str = "xor"
    polynomial: int = 0
    start: int = 0
    final_xor: int = 0


@dataclass(frozen=True)
class BusFrame:
    """One frame. period: s between two that are sent; 0: it is read."""

    name: str
    identifier: int
    length: int
    signals: tuple[BusSignal, ...]
    period: float = 0.0
    extended: bool = False
    fd: bool = False
    protection: BusProtection | None = None


@dataclass(frozen=True)
class Bus:
    """Frames on one CAN bus, the most urgent first. bitrate: bit/s; 0: unknown."""

    name: str
    frames: tuple[BusFrame, ...]
    bitrate: int = 0

    @property
    def buffer(self) -> int:
        """Most bytes of the operations that are sent in one event."""
        sent = (HEADER_BYTES + frame.length for frame in self.frames if frame.period > 0.0)
        return sum(sent) + SPARE_BYTES

    def interval(self, step: float) -> int:
        """Return the internal steps between the ticks of the clock at which frames are sent.

        step: s. Raises ValueError where a period is no multiple of the step.
        """
        every = [steps_of(frame, step) for frame in self.frames if frame.period > 0.0]
        return reduce(gcd, every) if every else max(round(1e-3 / step), 1)


def steps_of(frame: BusFrame, step: float) -> int:
    """Return the internal steps between two frames; 0: it is read.

    step: s. Raises ValueError where the period is no multiple of the step.
    """
    steps = round(frame.period / step)
    if abs(steps * step - frame.period) > 1e-9:
        raise ValueError(
            f"{frame.name} is sent every {frame.period * 1e3:g} ms: no multiple of the internal"
            f" step, {step * 1e3:g} ms"
        )
    return steps


def named(frames: Sequence[BusFrame]) -> str:
    """Return frames and their variables, for a person."""
    return "; ".join(
        f"{frame.name} ({', '.join(s.variable for s in frame.signals if s.variable)})"
        for frame in frames
    )

"""Result of reading a log: frames in order of time, and warnings."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from slipbench.protocol.logs.frame_log import FrameLog

Progress = Callable[[float], None]
"""Callback for progress: the share that is done, 0..1."""


def quiet(_share: float) -> None:
    """Show no progress."""


@dataclass
class LogText:
    """A log of any format as candump text, piece by piece; every piece ends at a line's end.

    format    what the file is, for people: "candump text", "Vector ASC"
    pieces    the text; may be consumed once
    warnings  grows while the pieces are consumed
    """

    format: str
    pieces: Iterator[bytes]
    warnings: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class LogReading:
    """The frames of one log in order of time, and every warning."""

    frames: FrameLog
    format: str
    warnings: tuple[str, ...]

"""Faults of frames, as values and not as exceptions."""

from dataclasses import dataclass
from enum import StrEnum


class Fault(StrEnum):
    """Names of the faults in recordings and reports."""

    UNKNOWN = "unknown identifier"
    SHORT = "too short"
    CRC = "wrong CRC"
    RANGE = "out of range"
    LOST = "lost"
    REPEATED = "repeated"
    STALE = "stale"


@dataclass(frozen=True, slots=True)
class FrameFault:
    """A frame that must not be used as it is.

    message   name in the database, "" where it has none
    signal    the signal that is out of range, else ""
    expected, found  for people: "8 bytes", "5 bytes"
    count     frames concerned: how many were lost
    """

    fault: Fault
    message: str = ""
    signal: str = ""
    expected: str = ""
    found: str = ""
    count: int = 1

    def __str__(self) -> str:
        """The fault in one line."""
        where = ".".join(part for part in (self.message, self.signal) if part)
        detail = f" (expected {self.expected}, found {self.found})" if self.expected else ""
        number = f" {self.count}" if self.fault is Fault.LOST else ""
        return f"{where}: {self.fault}{number}{detail}"

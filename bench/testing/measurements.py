"""Measurements of a test: value, unit, limits, requirement; plain data for reports.

This file is imported in every pytest run, so it imports the standard library only.
"""

from dataclasses import asdict, dataclass
from typing import Any

LATENESS = "lateness of the test"  # measured of every test in real time


@dataclass(frozen=True)
class Measurement:
    """One measured value and its limits, all in `unit`. at: s on the clock of the bus."""

    name: str
    value: float
    unit: str = ""
    at_least: float | None = None
    at_most: float | None = None
    requirement: str = ""
    source: str = ""
    at: float | None = None

    @property
    def inside(self) -> bool:
        """Whether the value is inside its limits; NaN is inside none."""
        above = self.at_least is None or self.value >= self.at_least
        below = self.at_most is None or self.value <= self.at_most
        return above and below

    @property
    def limits(self) -> str:
        """The limits in words; empty where there are none."""
        if self.at_least is not None and self.at_most is not None:
            return f"{self.at_least:g} to {self.at_most:g} {self.unit}".strip()
        if self.at_least is not None:
            return f"at least {self.at_least:g} {self.unit}".strip()
        return "" if self.at_most is None else f"at most {self.at_most:g} {self.unit}".strip()

    @property
    def shown(self) -> str:
        """Value and unit."""
        return f"{self.value:.6g} {self.unit}".strip()

    @property
    def verdict(self) -> str:
        """The word "passed", "failed" or, without limits, "recorded"."""
        return ("passed" if self.inside else "failed") if self.limits else "recorded"

    def __str__(self) -> str:
        """One line: name, value, limits, requirement, source."""
        parts = [f"{self.name}: {self.shown}"]
        parts += [f"expected {self.limits}"] if self.limits else []
        parts += [self.requirement] if self.requirement else []
        parts += [f"from {self.source}"] if self.source else []
        return ", ".join(parts)

    def as_json(self) -> dict[str, Any]:
        """The measurement as plain data, for a report that travels between processes."""
        return asdict(self)


def failures(measurements: list[Measurement]) -> str:
    """All measurements outside their limits, one a line; empty where there are none."""
    outside = [each for each in measurements if not each.inside]
    if not outside:
        return ""
    number = f"{len(outside)} of {len(measurements)} measurements outside their limits"
    return "\n".join([number, *(f"  {each}" for each in outside)])

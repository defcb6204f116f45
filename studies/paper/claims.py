"""A claim: a figure, the bounds that it must lie in, and its source."""

import math
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Claim:
    """One statement of the paper or the method that the recordings must confirm.

    name       short and unique: "first_harmonic_resonance_throttle"
    statement  what is claimed, in a sentence
    value      result, in `unit`; NaN where it could not be determined
    low, high  bounds of the value, both included
    unit       unit as displayed: "w_c", "°", "ms", "dB", "1"
    source     figure or equation of the paper, or of the method
    note       how it was determined, or why it could not be
    """

    name: str
    statement: str
    value: float
    low: float
    high: float
    unit: str
    source: str
    note: str = ""

    @property
    def holds(self) -> bool:
        """Whether the value lies in its bounds; False where it is unknown."""
        return bool(self.low <= self.value <= self.high)  # NaN lies nowhere

    def described(self) -> dict[str, Any]:
        """Claim as a tree for claims.json; null for an unknown value or an open bound."""
        finite = {
            key: float(value) if math.isfinite(value) else None
            for key, value in (("value", self.value), ("low", self.low), ("high", self.high))
        }
        return {
            "name": self.name,
            "statement": self.statement,
            **finite,
            "unit": self.unit,
            "pass": self.holds,
            "source": self.source,
            "note": self.note,
        }

"""A claim is a figure with the band that it must lie in, and where the claim comes from."""

import math
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Claim:
    """One statement that a recording must bear out.

    name       short and unique: "first_harmonic_resonance_throttle"
    statement  what is claimed, in a sentence for people
    value      what was found, in `unit`; NaN where it could not be found
    low, high  the band that it must lie in, both ends included
    unit       as shown to people: "w_c", "°", "ms", "dB", "1"
    source     figure or equation of the paper, or of the method
    note       how it was found, or why it was not
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
        """Tell whether the figure lies in its band; an unknown one does not."""
        return bool(self.low <= self.value <= self.high)  # NaN lies nowhere

    def described(self) -> dict[str, Any]:
        """Lay it out for claims.json; an unknown figure is null, an open end is null."""
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

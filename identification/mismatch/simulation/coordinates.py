"""What is not known exactly, as numbers whose prior is the unit normal.

A parameter p with value p0 and half width d (95 %) is p0 exp(s x), s = d / (1.96 p0), x ~ N(0, 1):
positive numbers err by factors. What may have either sign is p0 + s x.
"""

import math
from dataclasses import dataclass

NORMAL_95 = 1.959964
STATED_SHARE = 0.05
"""Half width (95 %) of a parameter of which the file tells none, as a share of it."""
CLOCK_OWNER = "clock"
LEAST = 0.3
"""Share of a value that one step leaves at least."""


@dataclass(frozen=True)
class Coordinate:
    """owner: the part that has the number; scale: of the logarithm, or of the number if linear."""

    owner: str
    name: str
    value: float
    scale: float
    linear: bool = False

    @property
    def key(self) -> str:
        """Name as in the file that tells the system."""
        return f"{self.owner}.{self.name}"

    @property
    def of_clock(self) -> bool:
        """Whether it is what a clock of these recordings is late by, s."""
        return self.owner == CLOCK_OWNER

    def at(self, x: float) -> float:
        """Return the parameter's value at the coordinate x."""
        if self.linear:
            return self.value + self.scale * x
        return self.value * math.exp(self.scale * x)

    def moved(self, x: float, step: float) -> float:
        """Return the coordinate after a step by which the value, not its logarithm, changes in proportion.

        Equations contain values: numbers that make up for each other do so along a line of values.
        """
        if self.linear or not self.scale:
            return x + step
        return x + math.log(max(1.0 + self.scale * step, LEAST)) / self.scale

    def slope(self, x: float) -> float:
        """Return how fast the value changes with the coordinate."""
        return self.scale if self.linear else self.scale * self.at(x)

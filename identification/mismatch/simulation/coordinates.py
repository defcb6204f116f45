"""Uncertain parameters, as coordinates with a unit normal prior.

A parameter p with value p0 and half width d (95 %) is p0 exp(s x), s = d / (1.96 p0), x ~ N(0, 1):
the error of a positive number is a factor. A parameter that may have either sign is p0 + s x.
"""

import math
from dataclasses import dataclass

NORMAL_95 = 1.959964
STATED_SHARE = 0.05
"""Half width (95 %) where the file states none, as a share of the value."""
CLOCK_OWNER = "clock"
LEAST = 0.3
"""Smallest factor by which one step may change a value."""


@dataclass(frozen=True)
class Coordinate:
    """owner: part that has the parameter; scale: of its logarithm, or of its value if linear."""

    owner: str
    name: str
    value: float
    scale: float
    linear: bool = False

    @property
    def key(self) -> str:
        """Name as in the file of the system."""
        return f"{self.owner}.{self.name}"

    @property
    def of_clock(self) -> bool:
        """Whether it is the offset of a clock of these recordings, s."""
        return self.owner == CLOCK_OWNER

    def at(self, x: float) -> float:
        """Return the parameter's value at the coordinate x."""
        if self.linear:
            return self.value + self.scale * x
        return self.value * math.exp(self.scale * x)

    def moved(self, x: float, step: float) -> float:
        """Return the coordinate after a step that changes the value, not its logarithm, linearly.

        Equations contain values: parameters that compensate each other do so on a line of values.
        """
        if self.linear or not self.scale:
            return x + step
        return x + math.log(max(1.0 + self.scale * step, LEAST)) / self.scale

    def slope(self, x: float) -> float:
        """Return the derivative of the value with respect to the coordinate."""
        return self.scale if self.linear else self.scale * self.at(x)

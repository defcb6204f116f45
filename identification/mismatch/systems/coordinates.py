"""Parameters of a model file move as far as they were believed, and hardly further.

A parameter that runs away to where the simulation shows next to nothing leaves no effect anything
to act on: a time constant of 0.5 s +- 0.4 s was taken to 20 s where the physics was wrong, and
with the motion its cause was gone. Beyond REACH prior deviations lies not another value of the
parameter but physics that is missing.
"""

import math
from dataclasses import dataclass

from identification.mismatch.coordinates import Coordinate

REACH = 3.0
"""Prior deviations that a parameter approaches at most: 99.7 % of what is believed."""


@dataclass(frozen=True)
class Believed(Coordinate):
    """A coordinate x that moves its parameter as REACH tanh(x / REACH) would."""

    def at(self, x: float) -> float:
        """Return the parameter's value at the coordinate x."""
        return super().at(REACH * math.tanh(x / REACH))

    def slope(self, x: float) -> float:
        """Return how fast the value changes with the coordinate."""
        inner = math.tanh(x / REACH)
        plain = self.scale if self.linear else self.scale * self.at(x)
        return plain * (1.0 - inner * inner)

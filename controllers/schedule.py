"""Gains that follow the speed: between two designs the gains lie on a straight line.

The state is common to all of them (the integral is kept in the command's unit), so that a
change of speed moves the gains and nothing jumps.
"""

from bisect import bisect_right
from dataclasses import dataclass
from itertools import pairwise

from slipbench.controllers.pid import Pid


@dataclass(frozen=True)
class Schedule:
    """designs: (speed in m/s, controller), speeds increasing; beyond the ends the nearest holds."""

    designs: tuple[tuple[float, Pid], ...]

    def __post_init__(self) -> None:
        """Raise ValueError where speeds do not increase, or there are none."""
        speeds = [speed for speed, _ in self.designs]
        if not speeds or any(b <= a for a, b in pairwise(speeds)):
            raise ValueError("a schedule needs controllers at increasing speeds")

    def at(self, speed: float) -> Pid:
        """The controller for a speed, m/s; for an unknown speed the first."""
        speeds = [s for s, _ in self.designs]
        if not speed > speeds[0]:
            return self.designs[0][1]
        if speed >= speeds[-1]:
            return self.designs[-1][1]
        after = bisect_right(speeds, speed)
        (low, slower), (high, faster) = self.designs[after - 1 : after + 1]
        return slower.between(faster, (speed - low) / (high - low))

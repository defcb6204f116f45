"""The virtual motorcycle's suspension: both ends move with acceleration, and with the wheel's turn.

x'' = w^2 (x_static +- g_x a - x) - 2 z w x', one mode per end; an out-of-round tyre adds its turn.
It is what the travel sensors show, and acts on nothing: load transfer is an effect of the tyre.
"""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Suspension:
    """One end of the motorcycle.

    rest       m, travel at steady speed
    squat      m per m/s^2, quasi-static travel with acceleration (rear positive, front negative)
    frequency  rad/s, of the mode: 2 to 4 Hz on racing motorcycles
    damping    1
    runout     m, of the tyre, once per turn
    """

    rest: float
    squat: float
    frequency: float = 2 * math.pi * 2.8
    damping: float = 0.35
    runout: float = 0.2e-3


REAR = Suspension(rest=0.045, squat=2.2e-3)
FRONT = Suspension(rest=0.055, squat=-2.8e-3)


class Chassis:
    """Both travels, integrated with semi-implicit Euler steps of a millisecond."""

    def __init__(self) -> None:
        """Rest at steady speed."""
        self._ends = {REAR: (REAR.rest, 0.0), FRONT: (FRONT.rest, 0.0)}

    def move(self, acceleration: float, step: float) -> None:
        """Live through `step` s at `acceleration` (m/s^2)."""
        for end, (travel, rate) in self._ends.items():
            aim = end.rest + end.squat * acceleration
            rate += step * end.frequency**2 * (aim - travel)
            rate -= step * 2 * end.damping * end.frequency * rate
            self._ends[end] = (travel + step * rate, rate)

    def travels(self, rear_angle: float, front_angle: float) -> tuple[float, float]:
        """Give front and rear travel in m."""
        front = self._ends[FRONT][0] + FRONT.runout * math.sin(front_angle)
        return front, self._ends[REAR][0] + REAR.runout * math.sin(rear_angle)

"""Suspension travel of the virtual motorcycle, driven by acceleration and tyre run-out.

x'' = w^2 (x_static + g_x a - x) - 2 z w x', one mode for each end; the run-out of the tyre adds a
sine of the wheel angle. x: travel (m), x_static: `rest` (m), g_x: `squat` (m per m/s^2), a:
acceleration (m/s^2), w: `frequency` (rad/s), z: `damping`. The travel is measured and acts on nothing
else: load transfer is an effect of the tyre.
"""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Suspension:
    """Parameters of the suspension at one end.

    rest       m, travel at steady speed
    squat      m per m/s^2, quasi-static travel with acceleration (rear positive, front negative)
    frequency  rad/s, natural frequency: 2 to 4 Hz on racing motorcycles
    damping    1, damping ratio
    runout     m, radial run-out of the tyre, once per turn
    """

    rest: float
    squat: float
    frequency: float = 2 * math.pi * 2.8
    damping: float = 0.35
    runout: float = 0.2e-3


REAR = Suspension(rest=0.045, squat=2.2e-3)
FRONT = Suspension(rest=0.055, squat=-2.8e-3)


class Chassis:
    """Travel of both ends, integrated with semi-implicit Euler steps of a millisecond."""

    def __init__(self) -> None:
        """Start at the travel of steady speed."""
        self._rear, self._front = (REAR.rest, 0.0), (FRONT.rest, 0.0)

    def advance(self, acceleration: float, step: float) -> None:
        """Integrate over `step` s at a constant `acceleration` (m/s^2)."""
        self._rear = _moved(REAR, *self._rear, acceleration, step)
        self._front = _moved(FRONT, *self._front, acceleration, step)

    def travels(self, rear_angle: float, front_angle: float) -> tuple[float, float]:
        """Front and rear travel, m. rear_angle, front_angle: rad, of the wheels."""
        front = self._front[0] + FRONT.runout * math.sin(front_angle)
        return front, self._rear[0] + REAR.runout * math.sin(rear_angle)


def _moved(
    end: Suspension, travel: float, rate: float, acceleration: float, step: float
) -> tuple[float, float]:
    """Travel (m) and its rate after one step."""
    target = end.rest + end.squat * acceleration
    rate += step * end.frequency**2 * (target - travel)
    rate -= step * 2 * end.damping * end.frequency * rate
    return travel + step * rate, rate

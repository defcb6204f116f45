"""Slow disturbance by wind and grade: a force on a basis of tents, fitted with all parameters.

One tent every 1.5 s with a prior standard deviation of 30 N, and a pulse at the end of the warm-up,
when the simulated speed is no longer prescribed, with one of 0.05 m/s.
"""

import numpy as np

from slipbench.plant.signals import Floats

KNOT = 1.5  # s
FORCE = 30.0  # N, 1 sigma
RELEASE = 0.05  # m/s, 1 sigma
DISTURBANCE = 0.05  # s, of the pulse


def road_tents(rows: int, mass: float, lead_in: float, step: float) -> Floats:
    """Force per unit of each coordinate, (rows, K), N. lead_in, step: s."""
    time = step * (np.arange(rows) + 0.5)
    knots = np.linspace(lead_in, time[-1], max(int((time[-1] - lead_in) / KNOT), 2) + 1)
    spacing = knots[1] - knots[0]
    tents = FORCE * np.maximum(0.0, 1.0 - np.abs(time[:, None] - knots) / spacing)
    pulse = np.where(
        (time > lead_in) & (time < lead_in + DISTURBANCE), mass * RELEASE / DISTURBANCE, 0.0
    )
    return np.column_stack((tents * (time > lead_in)[:, None], pulse))

"""Wind and grade push slowly; they are estimated beside everything else, as hats of force.

One hat every 1.5 s with 30 N of prior deviation, and a push at the moment at which the simulation's
speed is let go, worth 0.05 m/s.
"""

import numpy as np

from identification.mismatch.record import LEAD_IN
from identification.mismatch.sampling import STEP
from plant.signals import Floats

KNOT = 1.5  # s
FORCE = 30.0  # N, 1 sigma
RELEASE = 0.05  # m/s, 1 sigma
PUSH = 0.05  # s


def road_hats(rows: int, mass: float) -> Floats:
    """Force per unit of each coordinate, (rows, K), N."""
    time = STEP * (np.arange(rows) + 0.5)
    knots = np.linspace(LEAD_IN, time[-1], max(int((time[-1] - LEAD_IN) / KNOT), 2) + 1)
    spacing = knots[1] - knots[0]
    hats = FORCE * np.maximum(0.0, 1.0 - np.abs(time[:, None] - knots) / spacing)
    push = np.where((time > LEAD_IN) & (time < LEAD_IN + PUSH), mass * RELEASE / PUSH, 0.0)
    return np.column_stack((hats * (time > LEAD_IN)[:, None], push))

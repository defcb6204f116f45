"""Along what a free curve acts: the value of a quantity now, or its past.

Of the value now it is a broken line f(z) over knots of z. Of the past it is a sum of what z was
lately, forgotten with several times, so that any slow or resonant answer to z is nearly one of
these sums: the first of Laguerre's and Kautz's ideas (Wahlberg, IEEE Transactions on Automatic
Control 36 (1991)) with real poles in place of orthogonal functions.
"""

import numpy as np
from scipy import signal

from plant.signals import Floats

PAST = "past of "
TIMES = np.array((0.0, 0.02, 0.06, 0.2, 0.6, 2.0))
"""Seconds with which the past is forgotten; 0 is the value now."""
KNOTS = 7


def has_memory(regressor: str) -> bool:
    """Whether a regressor is the past of a quantity."""
    return regressor.startswith(PAST)


def knots_for(regressor: str, z: Floats) -> Floats:
    """Return where a curve has its values: knots of z, or times of forgetting; empty: no use."""
    if has_memory(regressor):
        return TIMES if np.ptp(z) > 0.0 else np.empty(0)
    return knots_between(z)


def columns(regressor: str, z: Floats, knots: Floats, width: float) -> Floats:
    """Return the courses (T, knots) of which a curve is the sum. width: s, of a bin."""
    if has_memory(regressor):
        level = z - z.mean()
        return np.column_stack([_forgotten(level, width, time) for time in knots])
    return np.column_stack([np.interp(z, knots, row) for row in np.eye(knots.size)])


def step_response(knots: Floats, values: Floats, time: Floats) -> Floats:
    """What a curve of the past answers to a step of its quantity, after so many seconds."""
    past = knots > 0.0
    risen = 1.0 - np.exp(-time[:, None] / knots[past])
    return np.asarray(risen @ values[past] + values[~past].sum())


def knots_between(z: Floats) -> Floats:
    """Knots at quantiles, no two nearer than a thirtieth of the range."""
    low, high = np.quantile(z, (0.002, 0.998))
    if not high > low:
        return np.empty(0)
    wanted = 0.5 * np.quantile(z, np.linspace(0.002, 0.998, KNOTS)) + 0.5 * np.linspace(
        low, high, KNOTS
    )
    return wanted[np.concatenate(([True], np.diff(wanted) > (high - low) / 30))]


def _forgotten(z: Floats, width: float, time: float) -> Floats:
    if time <= 0.0:
        return z
    keep = np.exp(-width / time)
    first = [keep * z[0]]
    return np.asarray(signal.lfilter([1.0 - keep], [1.0, -keep], z, zi=first)[0])

"""Air that arrives at the engine late: its derivatives to the throttle's history and to the delay.

The function is part of the text of the kernel with tangents (see tangents.py).
"""

import math

from slipbench.plant.kernel import Floats


def arriving_slopes(
    throttle: float,
    air_delay: float,
    stage: float,
    step: float,
    count: int,
    history: Floats,
    history_rate: Floats,
) -> tuple[float, float, float, int, int, float, float, float, float]:
    """`equations.arriving` with its derivatives.

    Returns the value, its derivatives to throttle and air_delay, two places in the history, and the
    derivatives to position and rate at the first and at the second of them.
    throttle: 0..1; air_delay, step: s; history, history_rate: shape (ring,).
    """
    capacity = len(history)
    furthest = 2.0 - capacity
    back = max(stage - air_delay / step, furthest)
    slope = -1.0 / step if back > furthest else 0.0
    i = count & (capacity - 1)
    if back >= 0.0:
        if stage == 0.0:
            return throttle, 1.0, 0.0, i, i, 0.0, 0.0, 0.0, 0.0
        share = back / stage
        curve = throttle - history[i] - history_rate[i] * step * stage
        value = history[i] + history_rate[i] * step * back + curve * share**2
        to_back = history_rate[i] * step + 2.0 * curve * share / stage
        rate = step * back - step * stage * share**2
        return value, share**2, to_back * slope, i, i, 1.0 - share**2, rate, 0.0, 0.0
    whole = math.floor(back)
    f = back - whole
    i = (count + int(whole)) & (capacity - 1)
    j = (i + 1) & (capacity - 1)
    rise = history[j] - history[i]
    bend = (1.0 - f) * (history_rate[i] * step - rise) - f * (history_rate[j] * step - rise)
    value = history[i] + f * rise + f * (1.0 - f) * bend
    to_bend = 2.0 * rise - (history_rate[i] + history_rate[j]) * step
    to_back = rise + (1.0 - 2.0 * f) * bend + f * (1.0 - f) * to_bend
    to_rise = f + f * (1.0 - f) * (2.0 * f - 1.0)
    first = f * (1.0 - f) * (1.0 - f) * step
    second = -f * (1.0 - f) * f * step
    return value, 0.0, to_back * slope, i, j, 1.0 - to_rise, first, to_rise, second

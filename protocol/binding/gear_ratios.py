"""Speeds of one vehicle beside each other: do they agree, and does their ratio step with the gears?"""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

SLOW = 3.0  # m/s, below which a ratio of speeds is not formed
GEARS = 7  # ratios that are looked for
WIDTH = 0.02  # of one ratio, relative, to either side
FEWEST = 30  # samples on the common time base from which anything is concluded


def correlation(one: Array, other: Array) -> float:
    """Correlation of two series, (n,) each; 0 where one is constant."""
    if one.size < FEWEST or np.ptp(one) == 0 or np.ptp(other) == 0:
        return 0.0
    return float(np.corrcoef(one, other)[0, 1])


def stepped(engine: Array, speed: Array) -> tuple[float, list[float]]:
    """Share of the samples whose ratio engine / speed lies at one of a few values, and those values.

    engine: rad/s, speed: m/s, (n,) each. Only ratios that hold at least 4 % of the samples count.
    """
    moving = (speed > SLOW) & (engine > 0)
    if np.count_nonzero(moving) < FEWEST:
        return 0.0, []
    logs = np.sort(np.log(engine[moving] / speed[moving]))
    total, inside, found = logs.size, 0, []
    for _ in range(GEARS):
        if not logs.size:
            break
        ends = np.searchsorted(logs, logs + 2 * WIDTH, side="right")
        counts = ends - np.arange(logs.size)
        first = int(counts.argmax())
        if counts[first] < 0.04 * total:
            break
        found.append(float(np.exp(np.median(logs[first : ends[first]]))))
        inside += int(counts[first])
        logs = np.concatenate([logs[:first], logs[ends[first] :]])
    return inside / total, found


def explained_ratio(gear: Array, engine: Array, speed: Array) -> float:
    """Share of the variance of log(engine / speed) that the values of a gear explain. (n,) each."""
    moving = (speed > SLOW) & (engine > 0) & (gear == np.round(gear))
    values = np.unique(gear[moving])
    if np.count_nonzero(moving) < FEWEST or not 2 <= values.size <= 10:
        return 0.0
    logs, gears = np.log(engine[moving] / speed[moving]), gear[moving]
    within = sum(
        float(((logs[gears == v] - np.median(logs[gears == v])) ** 2).sum()) for v in values
    )
    total = float(((logs - logs.mean()) ** 2).sum())
    return 1.0 - within / total if total > 0 else 0.0

"""What a ride under slip control is judged by."""

import numpy as np

from slipbench.identification.closed_loop_simulation.ride import Ridden
from slipbench.protocol.recording.channel import FloatArray


def mean_retard(ridden: Ridden) -> float:
    """Mean of the spark's retard, rad: what it costs in efficiency."""
    return float(np.mean(np.maximum(-ridden.spark, 0.0)))


def error(ridden: Ridden, after: float = 0.0) -> float:
    """Root mean square distance of slip from target, from `after` s on."""
    part = ridden.time >= after
    return float(np.sqrt(np.mean((ridden.slip[part] - ridden.target[part]) ** 2)))


def time_lost(ridden: Ridden, best: Ridden) -> float:
    """Time behind the best constant slip at the end, s: distance behind over speed."""
    behind = float(best.distance[-1] - ridden.distance[-1])
    return behind / max(float(best.speed[-1]), 1.0)


def calm(slip: FloatArray) -> bool:
    """Tell whether a loop is stable: it swings no more at its end than in its middle."""
    half = slip.size // 2
    quarter = slip.size // 4
    early, late = np.ptp(slip[half : half + quarter]), np.ptp(slip[-quarter:])
    return bool(np.isfinite(late) and late < max(1.5 * early, 0.002))

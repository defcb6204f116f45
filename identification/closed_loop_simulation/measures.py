"""Performance measures of a simulated ride under slip control."""

import numpy as np

from slipbench.identification.closed_loop_simulation.ride import Ridden
from slipbench.protocol.recording.channel import FloatArray


def mean_retard(ridden: Ridden) -> float:
    """Mean spark retard, rad, as a measure of lost efficiency."""
    return float(np.mean(np.maximum(-ridden.spark, 0.0)))


def error(ridden: Ridden, after: float = 0.0) -> float:
    """Rms tracking error of slip from time `after` (s) on."""
    part = ridden.time >= after
    return float(np.sqrt(np.mean((ridden.slip[part] - ridden.target[part]) ** 2)))


def time_lost(ridden: Ridden, best: Ridden) -> float:
    """Time lost against the best ride at the end, s: distance behind over its speed."""
    behind = float(best.distance[-1] - ridden.distance[-1])
    return behind / max(float(best.speed[-1]), 1.0)


def decays(slip: FloatArray) -> bool:
    """Whether a loop is stable: its oscillation does not grow. slip: shape (n,)."""
    half = slip.size // 2
    quarter = slip.size // 4
    early, late = np.ptp(slip[half : half + quarter]), np.ptp(slip[-quarter:])
    return bool(np.isfinite(late) and late < max(1.5 * early, 0.002))

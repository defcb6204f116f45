"""The speed of a wheel from a tooth counter that is read at intervals and wraps.

A reading is a whole number of teeth, so a difference over T is uncertain by one tooth:
abs(dw) <= 2 pi / (N T). The window T trades this error against delay.
"""

import numpy as np

from slipbench.identification.signals.samples import Samples, sampled
from slipbench.protocol.recording.channel import FloatArray

WINDOW = 0.2  # s


def teeth_per_second(
    time: FloatArray, count: FloatArray, modulo: int, window: float = WINDOW, origin: str = ""
) -> Samples:
    """Teeth in a second, centred in a window. time: s, (n,); count wraps at `modulo`, (n,)."""
    if time.size < 3:
        return sampled(time[:0], time[:0], origin)
    total = np.concatenate(([0.0], np.cumsum(np.mod(np.diff(count), modulo))))
    usual = float(np.median(np.diff(time)))
    apart = int(np.clip(round(window / usual), 1, time.size - 2))
    elapsed = time[apart:] - time[:-apart]
    rate = (total[apart:] - total[:-apart]) / np.maximum(elapsed, 1e-9)
    whole = elapsed < 1.5 * apart * usual
    return sampled((time[apart:] + time[:-apart])[whole] / 2, rate[whole], origin)


def resolution(window: float = WINDOW) -> float:
    """Least difference that a counter can show, teeth/s."""
    return 1.0 / window

"""Amplitude spectrum of a speed or a travel, with the frequencies of the wheel orders."""

from dataclasses import dataclass

import numpy as np
from scipy import signal

from slipbench.identification.signals.filters import bridged
from slipbench.protocol.recording.channel import FloatArray

STRETCH = 10.0  # s
SEGMENT = 4.0  # s, sets the resolution: 0.25 Hz before the window's widening
MOST_UNKNOWN = 0.02
LOWEST = 0.3  # Hz; slower is drift


@dataclass(frozen=True)
class Spectrum:
    """Amplitude spectrum of a segment.

    frequency  (n,) Hz
    amplitude  (n,) amplitude of a sine that would give this height, unit of the signal
    orders     (k,) Hz, mean frequency of the wheel's orders 1, 2, .. k in the segment
    width      Hz by which the first order moved in the segment
    start      s, where the segment begins; it lasts `length` s
    """

    role: str
    unit: str
    frequency: FloatArray
    amplitude: FloatArray
    orders: FloatArray
    width: float
    start: float
    length: float


def spectrum(
    role: str,
    unit: str,
    value: FloatArray,
    rate: float,
    segment: slice,
    wheel: FloatArray | None,
    reach: float = np.inf,
) -> Spectrum | None:
    """Welch spectrum of one signal over `segment`; None where too much of it is unknown.

    value: (n,) in `unit`; rate: Hz; wheel: (n,) Hz; reach: Hz, nothing above it is given.
    """
    part = value[segment]
    if part.size < 64 or np.mean(~np.isfinite(part)) > MOST_UNKNOWN:
        return None
    length = min(part.size, round(SEGMENT * rate))
    lines, power = signal.welch(
        signal.detrend(bridged(part)), rate, "hann", length, scaling="spectrum"
    )
    turning = wheel[segment] if wheel is not None else np.empty(0)
    turning = turning[np.isfinite(turning)]
    mean = float(turning.mean()) if turning.size else 0.0
    count = int(rate / 2 / mean) if mean > 0.5 else 0
    orders: FloatArray = mean * np.arange(1.0, count + 1)
    width = float(np.ptp(turning)) if turning.size else 0.0
    frequency: FloatArray = np.asarray(lines, dtype=np.float64)
    amplitude: FloatArray = np.asarray(np.sqrt(2 * power), dtype=np.float64)
    start = segment.start / rate
    kept = frequency <= reach
    if np.count_nonzero(kept & (frequency > LOWEST)) < 3:
        return None
    return Spectrum(
        role, unit, frequency[kept], amplitude[kept], orders, width, start, part.size / rate
    )


def steadiest(speed: FloatArray, rate: float, length: float = STRETCH) -> slice | None:
    """Find the segment in which a speed changes least while the vehicle moves. speed: m/s."""
    samples = min(round(length * rate), speed.size)
    known = np.flatnonzero(np.isfinite(speed))
    if known.size < samples // 2 or samples < 64:
        return None
    filled = bridged(speed)
    starts = np.arange(0, speed.size - samples + 1, max(1, samples // 10))
    spread = np.array([np.std(filled[s : s + samples]) for s in starts])
    unknown = np.array([np.mean(~np.isfinite(speed[s : s + samples])) for s in starts])
    mean = np.array([np.mean(filled[s : s + samples]) for s in starts])
    usable = (unknown <= MOST_UNKNOWN) & (mean > 0.5 * np.median(filled[known])) & (mean > 1.0)
    if not usable.any():
        return None
    best = int(starts[np.argmin(np.where(usable, spread / np.maximum(mean, 1e-9), np.inf))])
    return slice(best, best + samples)

"""Every device has a clock of its own; it is laid onto the bus clock by the frames' arrivals.

A frame arrives late, never early: arrival = offset + rate * device time + latency, latency >= 0.
The line sought is therefore the lower edge of the cloud, where frames met an idle bus. The least
latency in each of many windows stands for the edge; the median of the slopes between them (Theil
and Sen) gives the drift roughly, whatever queues there were, and the highest line that lies under
all of them gives it finely (Moon, Skelly and Towsley, INFOCOM 1999).
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy import optimize, stats

from slipbench.protocol.recording.channel import Channel, FloatArray

BUS = "bus"
FEWEST_SAMPLES = 16
SHORTEST_SPAN = 1.0  # s
STRAY = 2e-3  # s; a window this far from the line is not on the same line
STRAY_SHARE = 0.03  # of the windows


@dataclass(frozen=True)
class ClockFit:
    """A device's clock on the bus clock: bus = offset + rate * device.

    offset                    s, bus time at the device's zero, of a frame with the least latency
    rate                      bus seconds in a device second
    latency_p50, latency_p99  s, above the least latency observed
    """

    clock: str
    offset: float
    rate: float
    latency_p50: float
    latency_p99: float
    samples: int

    @property
    def drift(self) -> float:
        """Seconds that the device's clock gains in a second of the bus clock."""
        return 1.0 / self.rate - 1.0

    def to_bus(self, device: FloatArray) -> FloatArray:
        """Bus times (s) of device times (s), shape (n,)."""
        return self.offset + self.rate * device


@dataclass(frozen=True)
class Unaligned:
    """A clock that could not be laid onto the bus clock, and why."""

    clock: str
    reason: str


def align_all(channels: Iterable[Channel]) -> dict[str, ClockFit | Unaligned]:
    """Align every clock that the channels name; channels of one clock are pooled."""
    pools: dict[str, list[Channel]] = {}
    for channel in channels:
        if channel.clock != BUS and channel.time.size:
            pools.setdefault(channel.clock, []).append(channel)
    return {clock: _align_pool(clock, pool) for clock, pool in sorted(pools.items())}


def align(clock: str, device: FloatArray, arrival: FloatArray) -> ClockFit | Unaligned:
    """Fit one clock. device, arrival: (n,) s, device increasing. Late outliers do no harm."""
    if device.size < FEWEST_SAMPLES:
        return Unaligned(clock, f"{device.size} samples, at least {FEWEST_SAMPLES} are needed")
    span = float(device[-1] - device[0])
    if span < SHORTEST_SPAN:
        return Unaligned(clock, f"it spans {span:.3f} s, at least {SHORTEST_SPAN:g} s are needed")
    lead = arrival - device  # drifts slowly; numbers stay small
    rough = _rough_drift(device, lead)
    unsteady = _jump(clock, device, lead - rough * device)
    if unsteady:
        return unsteady
    offset, fine = _edge(device, lead - rough * device)
    slope = rough + fine
    p50, p99 = np.percentile(lead - slope * device - offset, (50, 99))
    return ClockFit(clock, offset, 1.0 + slope, float(p50), float(p99), device.size)


def _align_pool(clock: str, pool: list[Channel]) -> ClockFit | Unaligned:
    backwards = [c for c in pool if np.any(np.diff(c.time) < 0)]
    if backwards:
        at = int(np.argmax(np.diff(backwards[0].time) < 0))
        moment = backwards[0].time[at]
        return Unaligned(clock, f"it runs backwards after {moment:.6f} s ({backwards[0].origin})")
    silent = [c.role for c in pool if c.arrival is None]
    if silent:
        return Unaligned(clock, f"no arrival times were recorded ({', '.join(silent)})")
    device = np.concatenate([c.time for c in pool])
    arrival = np.concatenate([c.arrival for c in pool if c.arrival is not None])
    order = np.argsort(device, kind="stable")
    return align(clock, device[order], arrival[order])


def _window_minima(time: FloatArray, lead: FloatArray) -> tuple[FloatArray, FloatArray]:
    windows = int(np.clip(time.size // 16, 4, 120))
    length = time.size // windows
    table = lead[: windows * length].reshape(windows, length)
    lowest = np.arange(windows) * length + table.argmin(axis=1)
    return time[lowest], lead[lowest]


def _rough_drift(device: FloatArray, lead: FloatArray) -> float:
    slope = 0.0
    for _ in range(2):  # the windows' own drift hides their minima the first time
        time, least = _window_minima(device, lead - slope * device)
        slope += float(stats.theilslopes(least, time).slope)
    return slope


def _jump(clock: str, device: FloatArray, lead: FloatArray) -> Unaligned | None:
    """Find out whether the edge leaves a straight line for more than a few windows."""
    time, least = _window_minima(device, lead)
    if np.mean(np.abs(least - np.median(least)) > STRAY) <= STRAY_SHARE:
        return None
    span = float(np.ptp(least))
    moment = time[np.argmax(np.abs(np.diff(least)))]
    return Unaligned(clock, f"it jumps: {span * 1e3:.1f} ms about {moment:.2f} s of its time")


def _edge(device: FloatArray, lead: FloatArray) -> tuple[float, float]:
    """Offset and slope of the highest line under all windows' minima."""
    time, least = _window_minima(device, lead)
    middle, base = float(np.mean(device)), float(least.min())
    under = np.column_stack((np.ones_like(time), time - middle))
    found = optimize.linprog(
        [-1.0, -float(np.mean(time - middle))], under, (least - base) * 1e6, bounds=(None, None)
    )
    height, slope = np.asarray(found.x, dtype=np.float64) * 1e-6
    return base + float(height) - float(slope) * middle, float(slope)

"""A motorcycle's speed from noisy readings: it has mass, and its speed has no corners.

    e = z - (v + a dt),   v <- v + a dt + alpha e,   a <- a + beta e / dt

v speed (m/s), a acceleration (m/s^2), z reading. alpha = 1 - theta^2, beta = (1 - theta)^2 with
theta = exp(-dt / tau): critically damped, no lag at a steady acceleration; until tau has passed the
straight line through all readings so far (Brookner, Tracking and Kalman Filtering Made Easy, 1998,
chapter 1). Slip lives from how the wheel differs from this speed within tenths of a second; what
the speed itself does in them is next to nothing, so that the loop pays no phase for the calm.
"""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Track:
    """speed: m/s; slope: m/s^2; time: s, of the last reading; readings: so far, in a row."""

    speed: float = math.nan
    slope: float = 0.0
    time: float = -math.inf
    readings: int = 0

    def at(self, now: float) -> float:
        """Speed at `now` (s), m/s."""
        return self.speed + self.slope * (now - self.time)


@dataclass(frozen=True, slots=True)
class SpeedTracker:
    """memory: tau, s; silence: s after which a reading begins anew."""

    memory: float = 0.08
    silence: float = 0.015

    def update(self, track: Track, time: float, reading: float) -> Track:
        """Take a reading in. time: s; reading: m/s, known."""
        dt = time - track.time
        if not 0.0 < dt <= self.silence:
            return Track(reading, 0.0, time, 1)
        n = track.readings + 1
        theta = math.exp(-dt / self.memory)
        alpha = max(1.0 - theta**2, (4 * n - 2) / (n * (n + 1)))
        beta = max((1.0 - theta) ** 2, 6 / (n * (n + 1)))
        surprise = reading - track.at(time)
        return Track(track.at(time) + alpha * surprise, track.slope + beta / dt * surprise, time, n)

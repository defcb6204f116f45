"""Systems whose harmonics are known exactly: a static curve before a linear resonance with a delay.

z = u + b u^2 + c u^3 with u = A cos(phi) has harmonics 1 + 3 c A^2 / 4, b A / 2 and c A^2 / 4 per
amplitude; each then passes H at its own frequency. They do not imitate a curve behind the
resonance, nor one with memory.
"""

from dataclasses import dataclass

import numpy as np
from scipy import signal

RATE = 1000.0


@dataclass(frozen=True)
class Curved:
    """H: natural frequency in Hz, damping, delay in s; curve: square b and cube c."""

    natural: float = 8.0
    damping: float = 0.25
    delay: float = 0.010
    square: float = 6.0
    cube: float = 60.0

    def linear(self, frequency):
        """H at frequencies in Hz."""
        s, w = 2j * np.pi * np.asarray(frequency), 2 * np.pi * self.natural
        return w**2 / (s**2 + 2 * self.damping * w * s + w**2) * np.exp(-s * self.delay)

    def harmonics(self, frequency, amplitude, count=3):
        """G_k at excitation frequencies in Hz, (count, n)."""
        sizes = (
            1 + 0.75 * self.cube * amplitude**2,
            self.square * amplitude / 2,
            self.cube * amplitude**2 / 4,
        )
        return np.array([sizes[k] * self.linear((k + 1) * frequency) for k in range(count)])

    def answer(self, u):
        """Output to an input at RATE that was at rest before."""
        rest = int(2 * RATE)
        z = np.concatenate((np.zeros(rest), u + self.square * u**2 + self.cube * u**3))
        w = 2 * np.pi * self.natural
        plant = [w**2], [1, 2 * self.damping * w, w**2]
        above, below, _ = signal.cont2discrete(plant, 1 / RATE, method="foh")
        y = signal.lfilter(above.ravel(), below, z)
        return np.roll(y, round(self.delay * RATE))[rest:]


def sweep(start=0.5, stop=12.0, duration=30.0, law="linear"):
    """Unit sine whose frequency runs from start to stop, Hz."""
    t = np.arange(int(duration * RATE)) / RATE
    if law == "linear":
        return np.sin(2 * np.pi * (start * t + (stop - start) * t**2 / 2 / duration))
    growth = np.log(stop / start) / duration
    return np.sin(2 * np.pi * start * np.expm1(growth * t) / growth)


def coloured(n, seed, size, corner=15.0):
    """Noise through a first-order low pass, of a standard deviation; corner: Hz."""
    pole = np.exp(-2 * np.pi * corner / RATE)
    white = np.random.default_rng(seed).normal(size=n + 1000)
    return size * np.sqrt(1 - pole**2) * signal.lfilter([1], [1, -pole], white)[1000:]


def drift(n, seed, size):
    """A slow wander, as the speed of a motorcycle on a road; size: of its random steps per s."""
    steps = np.random.default_rng(seed + 10_000).normal(size=n) * size / np.sqrt(RATE)
    return np.cumsum(steps)

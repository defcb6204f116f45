"""Margins, sensitivity peaks and bandwidths of a feedback loop from its loop gain.

L = C G, S = 1 / (1 + L), T = L S. Gain and phase margin, sensitivity peak M_s = max |S| and the
complementary peak M_t = max |T| as in Skogestad and Postlethwaite, Multivariable Feedback Control
(2005), sections 2.4 and 2.5. Bandwidth is where |T| first falls through -3 dB;
rejection is where |S| first rises through -3 dB: slower disturbances are attenuated.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.response.following import HALF, between, first_fall
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray


@dataclass(frozen=True)
class Margins:
    """gain: factor; phase: rad; sensitivity, complementary: M_s and M_t; crossover, bandwidth,
    rejection: Hz, NaN outside the frequencies given; delay: delay margin, s."""

    gain: float
    phase: float
    sensitivity: float
    complementary: float
    crossover: float
    bandwidth: float
    rejection: float
    delay: float


def margins(frequency: FloatArray, loop: ComplexArray) -> Margins:
    """Margins of a loop gain. frequency: Hz, shape (n,), increasing; loop: complex, shape (n,)."""
    sensitivity = 1.0 / (1.0 + loop)
    closed = loop * sensitivity
    phase, crossover, delay = _phase(frequency, loop)
    return Margins(
        _gain(loop),
        phase,
        float(np.max(np.abs(sensitivity))),
        float(np.max(np.abs(closed))),
        crossover,
        first_fall(frequency, np.abs(closed)),
        _first_rise(frequency, np.abs(sensitivity)),
        delay,
    )


def encircled(loop: ComplexArray) -> int:
    """Encirclements of -1 by a loop gain (Nyquist criterion).

    0: a stable path with a stable or integrating controller is stable in closed loop. loop:
    complex, shape (n,), from well below to well above the bandwidth, dense enough to unwrap.
    """
    turned = np.unwrap(np.angle(1.0 + loop))
    return round(float(turned[-1] - np.angle(1.0 + loop[-1])) / (2 * np.pi))


def _gain(loop: ComplexArray) -> float:
    """Gain margin: smallest factor that moves a crossing of the negative real axis onto -1."""
    across = (loop.imag[:-1] * loop.imag[1:] <= 0.0) & (loop.imag[:-1] != loop.imag[1:])
    k = np.flatnonzero(across)
    share = loop.imag[k] / (loop.imag[k] - loop.imag[k + 1])
    real = loop.real[k] + share * (loop.real[k + 1] - loop.real[k])
    least = [max(-1.0 / r, -r) for r in real if r < 0.0]
    return float(min(least, default=np.inf))


def _phase(frequency: FloatArray, loop: ComplexArray) -> tuple[float, float, float]:
    """Phase margin (rad), highest crossover frequency (Hz) and delay margin (s)."""
    size = np.log(np.abs(loop))
    k = np.flatnonzero(size[:-1] * size[1:] < 0.0)
    if not k.size:
        return float("inf"), float("nan"), float("inf")
    share = size[k] / (size[k] - size[k + 1])
    at = frequency[k] + share * (frequency[k + 1] - frequency[k])
    turned = loop[k] + share * (loop[k + 1] - loop[k])
    ahead = np.mod(np.angle(-turned), 2 * np.pi)  # phase lag until it reaches -1
    phase = np.minimum(ahead, 2 * np.pi - ahead)
    return float(phase.min()), float(at[-1]), float(np.min(ahead / (2 * np.pi * at)))


def _first_rise(frequency: FloatArray, size: FloatArray) -> float:
    above = np.flatnonzero(size >= HALF)
    if not above.size or above[0] == 0:
        return float("nan")
    return between(frequency, size, int(above[0]) - 1)

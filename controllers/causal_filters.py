"""Filters for a controller: each output depends on the past alone, at the price of phase lag.

Every filter is a frozen object with `initial` and `update`; the state has a fixed size, so that a
control loop can keep it. `response` gives the phase lag at any frequency.

    notch = Notch(rate=1000.0, orders=(1,))
    state = notch.initial()
    clean, state = notch.update(state, speed, wheel_frequency)

Offline the same filters run forwards and backwards and cost no phase (identification does that);
teeth where they really stand (`pitch_learner`) cost none even online.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy import signal

SMOOTH = 1.0  # Hz, low pass that estimates the wheel frequency
WIDTH = 0.5  # Hz, half width of the notch
FloatArray = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]
Delays = tuple[float, ...]


@dataclass(frozen=True)
class LowPass:
    """Butterworth low pass. rate, cutoff: Hz; order: an even number."""

    rate: float
    cutoff: float
    order: int = 4

    @cached_property
    def coefficients(self) -> FloatArray:
        """Second-order sections, (k, 6)."""
        sections = signal.butter(self.order, self.cutoff, fs=self.rate, output="sos")
        return np.asarray(sections, np.float64)

    @cached_property
    def sections(self) -> tuple[tuple[float, ...], ...]:
        """The same as numbers that a loop reads quickly: b0, b1, b2, a1, a2 each."""
        return tuple(tuple(float(x) for x in (*row[:3], *row[4:])) for row in self.coefficients)

    @cached_property
    def rest(self) -> Delays:
        """State after 1 has been there for ever."""
        return tuple(float(x) for x in signal.sosfilt_zi(self.coefficients).ravel())

    def initial(self, value: float = 0.0) -> Delays:
        """The state after `value` has been there for ever."""
        return tuple(value * x for x in self.rest)

    def update(self, state: Delays, value: float) -> tuple[float, Delays]:
        """Take one sample in. Returns the filtered one and the next state."""
        after: Delays = ()
        for (b0, b1, b2, a1, a2), s, z in zip(self.sections, state[::2], state[1::2], strict=True):
            out = b0 * value + s
            after += (b1 * value - a1 * out + z, b2 * value - a2 * out)
            value = out
        return value, after

    def response(self, frequency: FloatArray) -> ComplexArray:
        """Complex response to a sine. frequency: Hz."""
        _, value = signal.freqz_sos(self.coefficients, worN=frequency, fs=self.rate)
        return np.asarray(value, np.complex128)


def wheel_follower(rate: float) -> LowPass:
    """Low pass that a notch is led by: 1 Hz, second order; it is 0.23 s late."""
    return LowPass(rate, SMOOTH, 2)


@dataclass(frozen=True)
class NotchState:
    """angle: of the wheel, rad; lines: cosine and sine amplitude of every order."""

    angle: float
    lines: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Notch:
    """Second-order notch at orders of a wheel that is followed by its angle.

    Amplitudes of each order are learnt in coordinates that turn with the wheel, so the notch moves
    without a jolt. At a steady wheel it is (s^2 + w^2) / (s^2 + 2 b s + w^2), b = 2 pi width (the
    adaptive canceller of Widrow and Glover, 1977). rate: Hz; width: Hz, half the notch's width.
    """

    rate: float
    orders: tuple[int, ...] = (1,)
    width: float = WIDTH

    @property
    def gain(self) -> float:
        """Share of the error that is learnt with each sample."""
        return 4 * math.pi * self.width / self.rate

    def initial(self) -> NotchState:
        """State without any line."""
        return NotchState(0.0, tuple((0.0, 0.0) for _ in self.orders))

    def update(self, state: NotchState, value: float, frequency: float) -> tuple[float, NotchState]:
        """Take one sample and the wheel's frequency (Hz) in; a sample that is NaN stays NaN."""
        angle = (state.angle + 2 * math.pi * frequency / self.rate) % (2 * math.pi)
        waves = [(math.cos(m * angle), math.sin(m * angle)) for m in self.orders]
        pairs = list(zip(state.lines, waves, strict=True))
        clean = value - sum(a * c + b * s for (a, b), (c, s) in pairs)
        step = self.gain * clean if math.isfinite(clean) else 0.0
        lines = tuple((a + step * c, b + step * s) for (a, b), (c, s) in pairs)
        return clean, NotchState(angle, lines)

    def response(self, frequency: FloatArray, wheel: float) -> ComplexArray:
        """Complex response to a sine while the wheel turns steadily. frequency, wheel: Hz."""
        z = np.exp(2j * np.pi * frequency / self.rate)
        cosines = [math.cos(2 * math.pi * order * wheel / self.rate) for order in self.orders]
        poles = [z**2 - 2 * z * c + 1 for c in cosines]  # 1 / (1 + sum of loops), over them all
        whole = np.prod(poles, axis=0)
        taken = sum(
            self.gain * (z * c - 1) * np.prod(poles[:index] + poles[index + 1 :], axis=0)
            for index, c in enumerate(cosines)
        )
        return np.asarray(whole / (whole + taken), np.complex128)


def smoothed_online(value: FloatArray, smooth: LowPass) -> FloatArray:
    """Run a low pass over samples as a controller would, from rest at the first. (n,), known."""
    out, state = np.empty_like(value), smooth.initial(float(value[0]))
    for index, sample in enumerate(value.tolist()):
        out[index], state = smooth.update(state, sample)
    return out


def notched_online(value: FloatArray, frequency: FloatArray, notch: Notch) -> FloatArray:
    """Run a notch over samples as a controller would. frequency: Hz, (n,), the wheel's."""
    out, state = np.empty_like(value), notch.initial()
    for index, (sample, wheel) in enumerate(zip(value.tolist(), frequency.tolist(), strict=True)):
        out[index], state = notch.update(state, sample, wheel)
    return out

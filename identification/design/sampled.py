"""An identified model as the controller's computer sees it: sampled, held, late.

The command is held for one period; what comes on top of the model's own delay (age of the tooth
speeds, frames on their way, waiting for the next tick) is counted once, in `extra`.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg, signal

from controllers.internal_model import Linear
from identification.models.rational_model import RationalModel
from identification.response.response import ComplexArray
from protocol.channel import FloatArray


FAR = 1e3  # a zero as far out as that is one at infinity


@dataclass(frozen=True, eq=False)
class Sampled:
    """zeros, poles, gain: of z, without the delay; delay: whole periods; period: s."""

    zeros: ComplexArray
    poles: ComplexArray
    gain: float
    delay: int
    period: float

    def response(self, frequency: FloatArray) -> ComplexArray:
        """Complex value at frequencies in Hz, delay included."""
        z = np.exp(2j * np.pi * np.asarray(frequency) * self.period)
        above = np.prod(z[:, None] - self.zeros, axis=1)
        below = np.prod(z[:, None] - self.poles, axis=1)
        return np.asarray(self.gain * above / below * z**-self.delay)

    @property
    def steady(self) -> float:
        """Answer to 1 in the steady state."""
        return float(np.real(self.gain * np.prod(1 - self.zeros) / np.prod(1 - self.poles)))


def sampled(model: RationalModel, extra: float, period: float) -> Sampled:
    """Sample a model whose input is held over `period` s; extra: delay on top of its own, s.

    Exact but for the part of a period that is left of the delay, which is rounded.
    """
    space = model.to_state_space()
    A, B, C, D, _ = signal.cont2discrete((space.A, space.B, space.C, space.D), period)
    poles = np.linalg.eigvals(A).astype(complex)
    zeros = _zeros(A, B, C, D)
    late = max(round((model.delay + extra) / period), 0)
    steady = float((C @ np.linalg.solve(np.eye(len(A)) - A, B) + D).item())
    gain = float(np.real(steady * np.prod(1 - poles) / np.prod(1 - zeros)))
    return Sampled(zeros, poles, gain, late, period)


def _zeros(A: FloatArray, B: FloatArray, C: FloatArray, D: FloatArray) -> ComplexArray:
    """Return the finite zeros: where the system's pencil loses rank."""
    n = len(A)
    pencil = np.block([[A, B], [C, D]])
    at = linalg.eigvals(pencil, np.diag([1.0] * n + [0.0]))
    return np.asarray(at[np.isfinite(at) & (np.abs(at) < FAR)], dtype=complex)


def held(frequency: FloatArray, period: float) -> ComplexArray:
    """Response of a zero-order hold at frequencies in Hz."""
    f = np.asarray(frequency)
    return np.asarray(np.sinc(f * period) * np.exp(-1j * np.pi * f * period))


def linear(zeros: ComplexArray, poles: ComplexArray, gain: float) -> Linear:
    """Return gain prod(z - zeros) / prod(z - poles) as sections in series, well conditioned."""
    if not poles.size:
        return Linear(np.zeros((0, 0)), np.zeros(0), np.zeros(0), gain)
    sections = signal.zpk2sos(zeros, poles, gain)
    whole = Linear(np.zeros((0, 0)), np.zeros(0), np.zeros(0), 1.0)
    for b0, b1, b2, _, a1, a2 in sections:
        if b2 == 0.0 and a2 == 0.0:
            whole = _series(whole, _first(b0, b1, a1))
        else:
            whole = _series(whole, _second(b0, b1, b2, a1, a2))
    return whole


def _first(b0: float, b1: float, a1: float) -> Linear:
    return Linear(np.array([[-a1]]), np.ones(1), np.array([b1 - a1 * b0]), float(b0))


def _second(b0: float, b1: float, b2: float, a1: float, a2: float) -> Linear:
    A = np.array([[-a1, -a2], [1.0, 0.0]])
    return Linear(A, np.array([1.0, 0.0]), np.array([b1 - a1 * b0, b2 - a2 * b0]), float(b0))


def _series(a: Linear, b: Linear) -> Linear:
    """Return b after a."""
    upper = np.hstack((a.A, np.zeros((a.B.size, b.B.size))))
    lower = np.hstack((np.outer(b.B, a.C), b.A))
    return Linear(
        np.vstack((upper, lower)), np.concatenate((a.B, b.B * a.D)),
        np.concatenate((b.D * a.C, b.C)), b.D * a.D,
    )  # fmt: skip

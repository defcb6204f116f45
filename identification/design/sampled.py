"""An identified model as the controller's computer sees it: sampled, held, late.

The command is held for one period; what comes on top of the model's own delay (age of the tooth
speeds, frames on their way, waiting for the next tick) is counted once, in `extra`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg, signal

from slipbench.identification.models.rational_model import RationalModel
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

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


def answer(rows: Sequence[Sequence[float]], z: ComplexArray) -> ComplexArray:
    """Return what sections in series answer at points z of the plane, (k,)."""
    found = np.ones(z.shape, dtype=complex)
    for b0, b1, b2, a1, a2 in rows:
        found *= (b0 * z * z + b1 * z + b2) / (z * z + a1 * z + a2)
    return found


def sections(
    zeros: ComplexArray, poles: ComplexArray, gain: float
) -> tuple[tuple[float, ...], ...]:
    """Return gain prod(z - zeros) / prod(z - poles) as sections (b0, b1, b2, a1, a2) in series."""
    if not poles.size:
        return ((gain, 0.0, 0.0, 0.0, 0.0),)
    rows = signal.zpk2sos(zeros, poles, gain)  # type: ignore[arg-type]
    late = poles.size - zeros.size
    for row in rows:  # scipy adds zeros at the origin until there are as many as poles: take them
        while late and row[2] == 0.0:  # back, each one a period of delay
            row[:3] = 0.0, row[0], row[1]
            late -= 1
    return tuple(tuple(float(x) for x in (*row[:3], *row[4:])) for row in rows)

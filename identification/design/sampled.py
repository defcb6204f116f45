"""Discrete-time form of an identified model with zero-order hold and delay.

The command is held for one period. The delay in addition to the dead time of the model (age of the
tooth speeds, transmission of frames, wait for the next tick) is counted once, in `extra`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg, signal

from slipbench.identification.models.rational_model import RationalModel
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

FAR = 1e3  # magnitude above which a zero counts as infinite


@dataclass(frozen=True, eq=False)
class Sampled:
    """zeros, poles, gain: of z, without the delay; delay: whole periods; period: s."""

    zeros: ComplexArray
    poles: ComplexArray
    gain: float
    delay: int
    period: float

    def response(self, frequency: FloatArray) -> ComplexArray:
        """Frequency response with delay, complex. frequency: Hz, shape (n,)."""
        z = np.exp(2j * np.pi * np.asarray(frequency) * self.period)
        above = np.prod(z[:, None] - self.zeros, axis=1)
        below = np.prod(z[:, None] - self.poles, axis=1)
        return np.asarray(self.gain * above / below * z**-self.delay)

    @property
    def steady(self) -> float:
        """DC gain."""
        return float(np.real(self.gain * np.prod(1 - self.zeros) / np.prod(1 - self.poles)))


def sampled(model: RationalModel, extra: float, period: float) -> Sampled:
    """Zero-order-hold equivalent of a model. period: s; extra: additional delay, s.

    Exact except that the delay is rounded to whole periods.
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
    """Finite transmission zeros: generalised eigenvalues of the system pencil."""
    n = len(A)
    pencil = np.block([[A, B], [C, D]])
    at = linalg.eigvals(pencil, np.diag([1.0] * n + [0.0]))
    return np.asarray(at[np.isfinite(at) & (np.abs(at) < FAR)], dtype=complex)


def held(frequency: FloatArray, period: float) -> ComplexArray:
    """Frequency response of a zero-order hold. frequency: Hz, shape (n,); period: s."""
    f = np.asarray(frequency)
    return np.asarray(np.sinc(f * period) * np.exp(-1j * np.pi * f * period))


def sections_response(rows: Sequence[Sequence[float]], z: ComplexArray) -> ComplexArray:
    """Response of second-order sections in series. z: complex, shape (k,); returns shape (k,)."""
    found = np.ones(z.shape, dtype=complex)
    for b0, b1, b2, a1, a2 in rows:
        found *= (b0 * z * z + b1 * z + b2) / (z * z + a1 * z + a2)
    return found


def sections(
    zeros: ComplexArray, poles: ComplexArray, gain: float
) -> tuple[tuple[float, ...], ...]:
    """Second-order sections (b0, b1, b2, a1, a2) of gain prod(z - zeros) / prod(z - poles)."""
    if not poles.size:
        return ((gain, 0.0, 0.0, 0.0, 0.0),)
    rows = signal.zpk2sos(zeros, poles, gain)  # type: ignore[arg-type]
    late = poles.size - zeros.size
    for row in rows:  # scipy adds zeros at the origin up to the number of poles; remove them, since
        while late and row[2] == 0.0:  # each one cancels a period of delay
            row[:3] = 0.0, row[0], row[1]
            late -= 1
    return tuple(tuple(float(x) for x in (*row[:3], *row[4:])) for row in rows)

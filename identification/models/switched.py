"""Slip responds differently while the throttle opens and while it closes: a switched linear system.

Corno and Savaresi 2009, equation 5: x' = A_i x + B_i u(t - tau), y = x_1; i is the sign of the
reference's derivative. The state is kept at the switch, in observability canonical form: it holds
the output and its derivatives, so that the slip does not jump. In each direction

    G_i = k_i (1 + s T_z,i) / (1 + s T_p,i)  prod_j w_j^2 / (s^2 + 2 z_j w_j s + w_j^2)  e^(-s tau)

Gain k_i, real pole -1 / T_p,i and zero -1 / T_z,i belong to the direction; resonances (w_j, z_j)
and the dead time tau are shared. A linear model is one whose two directions are the same.

    model = fit_steps(steps).model                       # identification/models/switched_fit.py
    slip = simulate(model, command - command[0], opening(command), 1000.0)
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from numba import njit

from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

if TYPE_CHECKING:
    import control

IntArray = npt.NDArray[np.int64]
STILL = 1e-9  # of the command's amplitude per sample; slower is rest and keeps the direction


@dataclass(frozen=True)
class Direction:
    """gain: output per input; pole, zero: their time constants, s; those of one direction."""

    gain: float
    pole: float
    zero: float


@dataclass(frozen=True)
class SwitchedModel:
    """Directions 0 (opening) and 1 (closing), and what they share.

    resonances  (w, z) pairs: rad/s and damping; delay: s
    """

    opening: Direction
    closing: Direction
    resonances: tuple[tuple[float, float], ...]
    delay: float

    @property
    def directions(self) -> tuple[Direction, Direction]:
        """Both directions, in the order of the mode numbers."""
        return self.opening, self.closing

    def response(self, frequency: FloatArray, mode: int = 0, delayed: bool = True) -> ComplexArray:
        """Frequency response while one direction lasts. frequency: Hz; mode: 0 opens, 1 closes."""
        s = 2j * np.pi * np.asarray(frequency)
        numerator, denominator = polynomials(self, mode)
        value = np.polyval(numerator, s) / np.polyval(denominator, s)
        return np.asarray(value * np.exp(-s * self.delay) if delayed else value)

    def to_control(
        self, mode: int = 0, names: tuple[str, str] = ("u", "y")
    ) -> "control.StateSpace":
        """One direction, without its delay, as a python-control object with named signals."""
        import control

        a, b, c = observability_form(*polynomials(self, mode))
        return control.ss(a, b[:, None], c[None, :], 0.0, inputs=[names[0]], outputs=[names[1]])


def polynomials(model: SwitchedModel, mode: int) -> tuple[FloatArray, FloatArray]:
    """Numerator and monic denominator of one mode in s (rad/s), highest power first, shape (k,)."""
    side = model.directions[mode]
    scale = 1.0 / side.pole
    denominator = np.array([1.0, scale])
    for w, z in model.resonances:
        denominator = np.convolve(denominator, [1.0, 2 * z * w, w * w])
        scale *= w * w
    return side.gain * scale * np.array([side.zero, 1.0]), denominator


def observability_form(
    numerator: FloatArray, denominator: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Matrices A, B, C with C = (1, 0, ...): the state is the output and its derivatives.

    B holds the Markov parameters, (Kailath, Linear Systems, section 2.3). Strictly proper; the
    denominator is monic.
    """
    n = denominator.size - 1
    b = np.concatenate((np.zeros(n - numerator.size), numerator))
    markov = np.zeros(n)
    for k in range(n):
        markov[k] = b[k] - denominator[1 : k + 1] @ markov[:k][::-1]
    a = np.diag(np.ones(n - 1), 1)
    a[-1] = -denominator[:0:-1]
    return a, markov, np.eye(n)[0]


def opening(command: FloatArray) -> IntArray:
    """Mode of each sample of a command, shape (n,): 0 while it rises, 1 while it falls.

    A constant command keeps the last mode.
    """
    change = np.diff(command, prepend=command[0])
    sign = np.where(np.abs(change) > STILL * np.ptp(command), np.sign(change), 0.0)
    return mode_of(sign)


def mode_of(signal: FloatArray) -> IntArray:
    """Mode of each sample from the sign of a signal, shape (n,): 0 positive, 1 negative.

    Zero keeps the last mode.
    """
    at = np.maximum.accumulate(np.where(signal != 0, np.arange(signal.size), 0))
    return np.asarray(signal[at] < 0, dtype=np.int64)


def simulate(
    model: SwitchedModel, u: FloatArray, mode: IntArray, rate: float, lag: float | None = None
) -> FloatArray:
    """Response of a model that starts at rest. u: (n,) change of the input; mode: (n,); rate: Hz.

    lag: s by which the mode is late; None: as late as the input, by the dead time. The input is
    taken as straight between samples.
    """
    index, count = np.arange(u.size), u.size
    late = np.interp(index - model.delay * rate, index, u, left=0.0)
    shift = round((model.delay if lag is None else lag) * rate)
    held = mode[np.clip(index - shift, 0, count - 1)]
    if model.opening == model.closing:
        held = np.zeros(count, dtype=np.int64)
    steps = [_discrete(model, int(k), rate) for k in np.unique(held)]
    a, b = (np.ascontiguousarray(np.stack(part)) for part in zip(*steps, strict=True))
    return np.asarray(_run(a, b, late, held if len(steps) > 1 else np.zeros_like(held)))


def _discrete(model: SwitchedModel, mode: int, rate: float) -> tuple[FloatArray, FloatArray]:
    """One sample of a direction; derivatives are per millisecond, or they differ too much."""
    a, b, _ = observability_form(*polynomials(model, mode))
    unit = 1e-3 ** np.arange(b.size)
    a, b = a * unit[:, None] / unit, b * unit
    whole = np.zeros((b.size + 1, b.size + 1))
    whole[:-1, :-1], whole[:-1, -1] = a / rate, b / rate
    step = _exponential(whole)
    return step[:-1, :-1], step[:-1, -1]


@njit(cache=True)
def _exponential(m: FloatArray) -> FloatArray:
    """Matrix exponential by scaling, Taylor and squaring: small matrices, thousands of them."""
    n, halvings, size = len(m), 0, np.abs(m).sum(axis=1).max()
    while size > 0.25:
        size, halvings = size / 2, halvings + 1
    scaled = m / 2.0**halvings
    total, term = np.eye(n), np.eye(n)
    for k in range(1, 13):
        term = _product(term, scaled) / k
        total += term
    for _ in range(halvings):
        total = _product(total, total)
    return total


@njit(cache=True)
def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    out = np.zeros_like(a)
    for i in range(len(a)):
        for k in range(len(a)):
            for j in range(len(a)):
                out[i, j] += a[i, k] * b[k, j]
    return out


@njit(cache=True)
def _run(a: FloatArray, b: FloatArray, u: FloatArray, mode: IntArray) -> FloatArray:
    n = b.shape[1]
    x, new, y = np.zeros(n), np.zeros(n), np.empty(u.size)
    for k in range(u.size):
        y[k] = x[0]
        m = mode[k]
        held = 0.5 * (u[k] + u[min(k + 1, u.size - 1)])
        for i in range(n):
            new[i] = b[m, i] * held
            for j in range(n):
                new[i] += a[m, i, j] * x[j]
        x, new = new, x
    return y

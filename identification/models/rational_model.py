"""A rational function of s behind a dead time: the plant model of a traction-control design.

G(s) = gain prod(s - z_i) / prod(s - p_i) e^(-s delay)

model.response(np.array([1.0, 5.0]))      # complex, at Hz
model.simulate(u, rate=1000.0)            # response to an input that is held between samples
model.to_control()                        # python-control, the delay left in model.delay
model.to_control(pade=3)                  # the delay as an all-pass of third order
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy import linalg

from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.notebook import card, table
from slipbench.protocol.recording.channel import FloatArray

if TYPE_CHECKING:
    import control


@dataclass(frozen=True)
class RationalModel:
    """A proper rational function with a dead time.

    input, output  roles; the response is in the output's SI unit per the input's
    zeros, poles   rad/s, complex ones in pairs
    gain           factor of prod(s - z) / prod(s - p), s in rad/s
    delay          s
    """

    input: str
    output: str
    zeros: ComplexArray
    poles: ComplexArray
    gain: float
    delay: float

    @property
    def stable(self) -> bool:
        """Whether every pole lies in the left half plane."""
        return bool(np.all(self.poles.real < 0))

    @property
    def right_zeros(self) -> ComplexArray:
        """Zeros in the right half plane, rad/s."""
        return self.zeros[self.zeros.real > 0]

    @property
    def minimum_phase(self) -> bool:
        """Whether the function without its delay has no zero in the right half plane."""
        return not self.right_zeros.size

    @property
    def numerator(self) -> FloatArray:
        """Coefficients of the numerator in s (rad/s), highest power first, shape (zeros + 1,)."""
        return np.asarray(self.gain * np.poly(self.zeros).real)

    @property
    def denominator(self) -> FloatArray:
        """Coefficients of the monic denominator in s (rad/s), highest power first, shape (poles + 1,)."""
        return np.asarray(np.atleast_1d(np.poly(self.poles).real))

    @property
    def without_delay(self) -> "RationalModel":
        """The rational function alone."""
        return replace(self, delay=0.0)

    def response(self, frequency: FloatArray) -> ComplexArray:
        """The complex response at frequencies in Hz, (n,)."""
        s = 2j * np.pi * np.asarray(frequency, dtype=np.float64)
        above = np.prod(s[:, None] - self.zeros, axis=1)
        below = np.prod(s[:, None] - self.poles, axis=1)
        return np.asarray(self.gain * above / below * np.exp(-s * self.delay))

    def simulate(self, u: FloatArray, rate: float) -> FloatArray:
        """Response to an input held between its samples, from rest at u[0].

        u: (n,), at `rate` Hz. Returns (n,), exact at the samples; the delay may be any part of a
        sample. Where the function has a steady state the response begins in it.
        """
        A, B, C, D, pace = _normal_form(self)
        late = int(self.delay * rate + 1e-9)  # whole samples in the delay
        rest = self.delay - late / rate  # 0 .. one sample, in s
        step, now, before = _held(A, B, pace / rate, min(max(rest * rate, 0.0), 1.0))
        v = u - u[0]
        fresh = _shifted(v, late)
        x, states = np.zeros(len(B)), np.empty((u.size, len(B)))
        drive = np.outer(fresh, now) + np.outer(_shifted(v, late + 1), before)
        for k in range(u.size):
            states[k] = x
            x = step @ x + drive[k]
        steady = self.response(np.zeros(1))[0].real if np.all(self.poles != 0) else 0.0
        direct = D * (fresh if rest * rate < 1e-9 else _shifted(v, late + 1))
        return np.asarray(states @ C + direct + steady * u[0])

    def to_control(self, pade: int = 0) -> "control.TransferFunction":
        """A python-control transfer function, s in rad/s, signals named by role.

        pade: order of the all-pass that stands for the delay; 0 leaves the delay out: it is in
        `self.delay`, and python-control has no place for it in continuous time.
        """
        import control

        above, below = control.pade(self.delay, pade) if pade else ([1.0], [1.0])
        return control.TransferFunction(
            np.polymul(self.numerator, above),
            np.polymul(self.denominator, below),
            inputs=[self.input],
            outputs=[self.output],
            name=f"{self.input} to {self.output}",
        )

    def to_frequency_data(self, frequency: FloatArray) -> "control.FrequencyResponseData":
        """A python-control frequency response with the exact delay; frequency in Hz, shape (n,)."""
        import control

        return control.FrequencyResponseData(
            self.response(frequency),
            2 * np.pi * np.asarray(frequency),
            inputs=[self.input],
            outputs=[self.output],
            name=f"{self.input} to {self.output}",
        )

    def to_state_space(self) -> "control.StateSpace":
        """A python-control state space without the delay, signals named by role."""
        import control

        A, B, C, D, pace = _normal_form(self)
        return control.StateSpace(
            A * pace,
            B[:, None] * pace,
            C[None, :],
            [[D]],
            inputs=[self.input],
            outputs=[self.output],
            name=f"{self.input} to {self.output}",
        )

    def _repr_html_(self) -> str:
        rows = [("gain of the highest powers", f"{self.gain:.6g}")]
        rows += [("dead time", f"{1e3 * self.delay:.4g} ms")]
        rows += [("zero", f"{complex(z):.4g} rad/s") for z in self.zeros]
        rows += [("pole", f"{complex(p):.4g} rad/s") for p in self.poles]
        return card(f"Model, {self.input} to {self.output}", [], table(("", "value"), rows))


def _normal_form(of: RationalModel) -> tuple[FloatArray, FloatArray, FloatArray, float, float]:
    """Controllable form in the time unit 1 / pace, in which the poles are about 1."""
    pace = float(np.exp(np.mean(np.log(np.abs(of.poles) + 1e-6)))) if of.poles.size else 1.0
    a = np.atleast_1d(np.poly(of.poles / pace).real)
    b = np.atleast_1d(np.poly(of.zeros / pace).real)
    b = of.gain * pace ** (of.zeros.size - of.poles.size) * b
    n = of.poles.size
    b = np.concatenate((np.zeros(n + 1 - b.size), b))
    A = np.zeros((n, n))
    if n:
        A[0], A[1:, :-1] = -a[1:], np.eye(n - 1)
    return A, np.eye(n, 1).ravel(), b[1:] - b[0] * a[1:], float(b[0]), pace


def _held(
    A: FloatArray, B: FloatArray, step: float, late: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Transition over a step, and the shares of the present and of the previous input in it."""
    whole, early = _transition(A, B, step), _transition(A, B, step * (1 - late))
    lately = _transition(A, B, step * late)
    return whole[0], early[1], early[0] @ lately[1]


def _transition(A: FloatArray, B: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    n = len(B)
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n] = A, B
    moved = np.asarray(linalg.expm(block * step))
    return moved[:n, :n], moved[:n, n]


def _shifted(v: FloatArray, by: int) -> FloatArray:
    return v if by == 0 else np.concatenate((np.zeros(min(by, v.size)), v[: max(v.size - by, 0)]))

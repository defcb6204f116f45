"""A rational function that cannot be unstable, and its derivatives.

    G(s) = sum b_k s^k / (prod (1 + a s + c s^2) (1 + T s)) e^(-s d),   a, c, T = e^theta > 0

Every stable denominator with unit steady value has this form, and every such form is stable: the
search needs no constraint. The numerator is free, so that a zero in the right half plane is a
finding. s, d and all coefficients are in the unit of time 1 / pace: near 1 for any vehicle.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.models.rational_model import RationalModel
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

LEAST, GREATEST = np.log(1e-3), np.log(1e3)  # of the denominator's coefficients


@dataclass(frozen=True, order=True)
class Order:
    """Number of poles and zeros of a rational function.

    at_rest  how many of the zeros are held at s = 0: what moves only while its input changes
    """

    poles: int
    zeros: int
    at_rest: int = 0

    @property
    def size(self) -> int:
        """Count of parameters, the delay among them."""
        return 1 + self.poles + self.zeros + 1 - self.at_rest

    def __str__(self) -> str:
        held = f" ({self.at_rest} of them at 0)" if self.at_rest else ""
        zeros = f"{self.zeros} zero{'' if self.zeros == 1 else 's'}{held}"
        return f"{zeros}, {self.poles} pole{'' if self.poles == 1 else 's'}"


def evaluate(x: FloatArray, s: ComplexArray, order: Order) -> tuple[ComplexArray, ComplexArray]:
    """G (n,) and its derivatives (n, p). x: delay, denominator's theta, numerator's b."""
    n = order.poles
    pairs = n // 2
    a = np.exp(x[1 : 1 + n])
    first, second = a[0 : 2 * pairs : 2], a[1 : 2 * pairs : 2]
    sections = 1 + s[:, None] * first + (s**2)[:, None] * second
    below = np.prod(sections, axis=1)
    if n % 2:
        below = below * (1 + s * a[-1])
    late = np.exp(-s * x[0]) / below
    powers = s[:, None] ** np.arange(order.zeros + 1)
    above = powers * late[:, None]
    G = above @ x[1 + n :]
    slopes = np.empty((s.size, order.size), dtype=np.complex128)
    slopes[:, 0] = -s * G
    slopes[:, 1 : 1 + 2 * pairs : 2] = -G[:, None] * s[:, None] * first / sections
    slopes[:, 2 : 1 + 2 * pairs : 2] = -G[:, None] * (s**2)[:, None] * second / sections
    if n % 2:
        slopes[:, n] = -G * s * a[-1] / (1 + s * a[-1])
    slopes[:, 1 + n :] = above
    return G, slopes


def model(x: FloatArray, order: Order, pace: float, names: tuple[str, str]) -> RationalModel:
    """Turn parameters into zeros, poles and gain in rad/s and a delay in s."""
    n = order.poles
    a, b = np.exp(x[1 : 1 + n]), x[1 + n :]
    poles = [np.roots([a[i + 1], a[i], 1.0]) for i in range(0, n - 1, 2)]
    if n % 2:
        poles.append(np.array([-1 / a[-1]]))
    zeros = np.roots(b[::-1]) if order.zeros else np.zeros(0)
    below = np.prod(a[1 : 2 * (n // 2) : 2]) * (a[-1] if n % 2 else 1.0)
    kept = zeros.size  # a leading coefficient that is zero is a zero at infinity
    gain = b[kept] / below * pace ** (n - kept)
    flat = np.concatenate([*poles, np.zeros(0)]).astype(np.complex128)
    return RationalModel(
        *names, zeros.astype(np.complex128) * pace, flat * pace, float(gain), float(x[0]) / pace
    )


def parameters(delay: float, below: FloatArray, above: FloatArray, order: Order) -> FloatArray:
    """Parameters of a fit from polynomials, poles reflected into the left half plane; shape (p,).

    delay: s. below, above: denominator and numerator, lowest power of s first, below[0] = 1.
    """
    poles = np.roots(below[::-1])
    poles = -np.abs(poles.real) + 1j * poles.imag
    poles = np.concatenate((poles, np.full(max(order.poles - poles.size, 0), -30.0)))
    paired = sorted(poles, key=lambda p: (abs(p.imag) < 1e-9, round(abs(p), 9), p.imag))
    theta: list[float] = []
    for i in range(0, order.poles - 1, 2):
        p, q = paired[i], paired[i + 1]
        theta += [(-(p + q) / (p * q)).real, (1 / (p * q)).real]
    if order.poles % 2:
        theta.append((-1 / paired[-1]).real)
    logs = np.log(np.clip(theta, np.exp(LEAST), np.exp(GREATEST)))
    return np.concatenate(([delay], logs, above))

"""A discrete linear system with one input and one output, built of sections in series.

    x+ = A x + B u,   y = C x + D u

Sections of second order in series keep their precision where one polynomial of high order, with
several poles near 1, would not.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Section = tuple[float, float, float, float, float]
"""b0, b1, b2, a1, a2 of (b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2)."""


@dataclass(frozen=True, eq=False)
class Linear:
    """A: (n, n); B, C: (n,); D: number; at a fixed step."""

    A: Floats
    B: Floats
    C: Floats
    D: float

    def rest(self, u: float) -> Floats:
        """Steady state under a constant input `u`, shape (n,)."""
        return np.asarray(self._rest_of_one * u)

    @cached_property
    def _rest_of_one(self) -> Floats:
        """Solved once: no tick has time for it."""
        return np.asarray(np.linalg.solve(np.eye(self.B.size) - self.A, self.B))

    @cached_property
    def gain(self) -> float:
        """Steady-state gain."""
        return float(self.C @ self.rest(1.0) + self.D)

    def response(self, z: npt.NDArray[np.complex128]) -> npt.NDArray[np.complex128]:
        """Complex response at points z of the plane, (k,)."""
        whole = z[:, None, None] * np.eye(self.B.size) - self.A
        x = np.linalg.solve(whole, np.tile(self.B + 0j, (z.size, 1))[..., None])[..., 0]
        return np.asarray(x @ self.C + self.D)


def in_series(sections: Sequence[Sequence[float]]) -> Linear:
    """Sections (b0, b1, b2, a1, a2), the first one first, as one system."""
    whole = Linear(np.zeros((0, 0)), np.zeros(0), np.zeros(0), 1.0)
    for b0, b1, b2, a1, a2 in sections:
        if b2 == 0.0 and a2 == 0.0:
            one = Linear(np.array([[-a1]]), np.ones(1), np.array([b1 - a1 * b0]), b0)
        else:
            A = np.array([[-a1, -a2], [1.0, 0.0]])
            one = Linear(A, np.eye(2)[0], np.array([b1 - a1 * b0, b2 - a2 * b0]), b0)
        whole = _after(whole, one)
    return whole


def _after(a: Linear, b: Linear) -> Linear:
    """B driven by a."""
    upper = np.hstack((a.A, np.zeros((a.B.size, b.B.size))))
    lower = np.hstack((np.outer(b.B, a.C), b.A))
    return Linear(
        np.vstack((upper, lower)),
        np.concatenate((a.B, b.B * a.D)),
        np.concatenate((b.D * a.C, b.C)),
        b.D * a.D,
    )

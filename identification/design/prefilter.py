"""Prefilter of the setpoint (second degree of freedom).

    P(s) = (s^2 / w_1^2 + 2 z_1 s / w_1 + 1) / (s^2 / w_2^2 + 2 z_2 s / w_2 + 1)

The loop is designed for margins and disturbance rejection, the prefilter for tracking: minimum
integral of the absolute error after a step over the uncertainty set, with limited overshoot for
every member and limited command effort (Skogestad and Postlethwaite 2005, section 2.6.2; Horowitz
1963). It lies outside the loop, so it changes no margin and passes no sensor noise. Maximum
bandwidth as the only criterion gave prefilters whose response fell to -3 dB below that bandwidth.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import optimize, signal

from slipbench.identification.design.problem import LinearController, Problem
from slipbench.identification.design.sampled import held, sections_response
from slipbench.identification.design.steps import paths
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

OVERSHOOT = 0.05  # limit over the set, of the step height
EFFORT = 4.0  # limit of the peak of the command response over its steady value
FREQUENCIES = ((2.0, 20.0), (2.0, 25.0))  # Hz, of zeros and poles
DAMPINGS = ((0.2, 2.0), (0.6, 2.0))
SEED = 1
FINE, TOP, LASTING = 0.1, 60.0, 0.8  # Hz, Hz, s


@dataclass(frozen=True)
class Prefilter:
    """zeros, poles: frequency (Hz) and damping of either pair; period: s."""

    zeros: tuple[float, float]
    poles: tuple[float, float]
    period: float

    @cached_property
    def section(self) -> tuple[float, float, float, float, float]:
        """b0, b1, b2, a1, a2 at the controller's step; steady gain 1."""
        above, below = (_quadratic(*pair) for pair in (self.zeros, self.poles))
        b, a = signal.bilinear(above, below, fs=1 / self.period)
        b = b * (a.sum() / b.sum())
        return (float(b[0]), float(b[1]), float(b[2]), float(a[1]), float(a[2]))

    def response(self, frequency: FloatArray) -> ComplexArray:
        """Frequency response, complex. frequency: Hz, shape (n,)."""
        return sections_response(
            (self.section,), np.exp(2j * np.pi * np.asarray(frequency) * self.period)
        )


def _quadratic(frequency: float, damping: float) -> list[float]:
    w = 2 * np.pi * frequency
    return [1 / w**2, 2 * damping / w, 1.0]


def quickest(problem: Problem, law: LinearController) -> Prefilter:
    """Prefilter with the smallest worst-case tracking error over the uncertainty set."""
    criterion = _PrefilterCost(problem, law)

    def made(x: FloatArray) -> Prefilter:
        f1, z1, f2, z2 = (float(e) for e in np.exp(x))
        return Prefilter((f1, z1), (f2, z2), problem.period)

    def cost(x: FloatArray) -> float:
        return criterion.cost(made(x))

    bounds = optimize.Bounds(*np.log([FREQUENCIES[0], DAMPINGS[0], FREQUENCIES[1], DAMPINGS[1]]).T)
    found = optimize.differential_evolution(
        cost,
        bounds,
        maxiter=40,
        popsize=10,
        tol=1e-4,
        rng=np.random.default_rng(SEED),
        polish=False,
    )
    return made(found.x)


class _PrefilterCost:
    """Cost of a prefilter; everything that does not depend on the prefilter is computed once."""

    def __init__(self, problem: Problem, law: LinearController) -> None:
        f = np.arange(FINE, TOP, FINE)
        reference, loop = law.reference_response(f), law.response(f)
        self._f = f
        by_member = paths(problem, f)
        self._closed = {
            name: reference * path / (1 + loop * path) for name, path in by_member.items()
        }
        self._command = reference / (1 + loop * by_member["nominal"])
        time = np.arange(0.0, LASTING, 0.004)
        w = 2 * np.pi * f
        self._in_time = (2 / np.pi) * np.sin(np.outer(time, w)) / w * (2 * np.pi * FINE)
        self._slow = (2 / np.pi) * time * (np.pi * FINE)
        self._at_tick = held(f, problem.period)

    def cost(self, candidate: Prefilter) -> float:
        """Logarithm of the worst-case error plus penalties for violated limits."""
        passed = candidate.response(self._f)
        steps = [self._step(passed * closed) for closed in self._closed.values()]
        error = max(float(np.mean(np.abs(1.0 - y))) for y in steps)
        over = max(float(y.max()) for y in steps) - 1.0
        effort = np.abs(passed * self._command)
        steady = np.abs(self._command[0])
        excess = max(over - OVERSHOOT, 0.0) + max(np.max(effort) / steady / EFFORT - 1.0, 0.0)
        return float(np.log(error) + 20.0 * excess)

    def _step(self, closed: ComplexArray) -> FloatArray:
        real = (closed / self._at_tick).real
        return np.asarray(self._in_time @ real + real[0] * self._slow)

"""The second degree of freedom: what a target is passed through before the loop follows it.

    P(s) = (s^2 / w_1^2 + 2 z_1 s / w_1 + 1) / (s^2 / w_2^2 + 2 z_2 s / w_2 + 1)

The loop is made for reserves and disturbances, the prefilter for the target: the least integral of
the absolute error after a step, over the set, while no motorcycle of it overshoots, and while the
command keeps inside its range for a target that moves by a share of what the actuator can give
(Skogestad and Postlethwaite 2005, section 2.6.2; Horowitz 1963). It costs no reserve, since it lies
outside the loop, and no sensor noise passes through it. A search for the greatest bandwidth alone
found prefilters whose answer sagged to -3 dB between rest and that bandwidth.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import optimize, signal

from slipbench.identification.design.problem import Answering, Problem
from slipbench.identification.design.sampled import answer, held
from slipbench.identification.design.steps import paths
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

OVERSHOOT = 0.05  # of a step, over the set
EFFORT = 4.0  # peak of the command's answer over its steady one
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
        """Complex value at frequencies in Hz."""
        return answer((self.section,), np.exp(2j * np.pi * np.asarray(frequency) * self.period))


def _quadratic(frequency: float, damping: float) -> list[float]:
    w = 2 * np.pi * frequency
    return [1 / w**2, 2 * damping / w, 1.0]


def quickest(problem: Problem, law: Answering) -> Prefilter:
    """Find the prefilter with which the slowest motorcycle of the set is soonest at its target."""
    judge = _Judge(problem, law)

    def made(x: FloatArray) -> Prefilter:
        f1, z1, f2, z2 = (float(e) for e in np.exp(x))
        return Prefilter((f1, z1), (f2, z2), problem.period)

    def cost(x: FloatArray) -> float:
        return judge.cost(made(x))

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


class _Judge:
    """All that stays the same while prefilters are tried."""

    def __init__(self, problem: Problem, law: Answering) -> None:
        f = np.arange(FINE, TOP, FINE)
        asked, loop = law.reference_response(f), law.response(f)
        self._f = f
        ways = paths(problem, f)
        self._closed = {name: asked * way / (1 + loop * way) for name, way in ways.items()}
        self._command = asked / (1 + loop * ways["nominal"])
        time = np.arange(0.0, LASTING, 0.004)
        w = 2 * np.pi * f
        self._in_time = (2 / np.pi) * np.sin(np.outer(time, w)) / w * (2 * np.pi * FINE)
        self._slow = (2 / np.pi) * time * (np.pi * FINE)
        self._at_tick = held(f, problem.period)

    def cost(self, tried: Prefilter) -> float:
        """Logarithm of the worst error, and what every broken condition costs."""
        passed = tried.response(self._f)
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

"""How quickly the throttle may take over from the spark: as quickly as the reserves allow.

    L = C (G_s (1 - F M) + k F G_t)

C the fast law, G_s and G_t paths from spark and from throttle, k = g_s / g_t, F = 1 / (1 + T s), M
the model of G_t / G_s with gain 1 at rest (see `controllers.mid_ranging`). With the true M the loop
is C G_s whatever T is; over the set, every pair of a spark's and a throttle's member must keep the
reserves, and the throttle no more than its share of sensor noise.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from identification.design.from_runs import Path
from identification.design.loop import encircled, margins
from identification.design.problem import Command, Problem
from identification.design.sampled import answer, sections
from identification.design.steps import paths
from identification.response.response import ComplexArray
from protocol.channel import FloatArray

TIMES = np.geomspace(0.01, 2.0, 40)  # s
FAST = 60.0  # Hz, of poles that a model needs to be proper
LEFT = 0.05  # of each reserve that the fast law leaves to the exchange


@dataclass(frozen=True)
class Exchange:
    """gain: throttle per spark; time: T, s; through, delay: M without its delay, and that in
    periods."""

    gain: float
    time: float
    through: tuple[tuple[float, ...], ...]
    delay: int

    def later(self, frequency: FloatArray, period: float) -> ComplexArray:
        """M at frequencies in Hz."""
        z = np.exp(2j * np.pi * np.asarray(frequency) * period)
        return np.asarray(answer(self.through, z) * z**-self.delay)


@dataclass(frozen=True)
class NoExchange:
    """Why the throttle cannot take over."""

    reason: str


def fast_path(spark: Path) -> Path:
    """Return the spark's path as a mixed controller's fast law is designed for: reserve is left."""
    problem = spark.problem
    return replace(
        spark, problem=replace(problem, required=problem.required.with_reserve(LEFT))
    )  # fmt: skip


def quickest_exchange(spark: Path, law: Command, throttle: Path) -> Exchange | NoExchange:
    """Find the least time of taking over with which every pair of members keeps its reserves."""
    period = spark.problem.period
    gain = spark.gain / throttle.gain
    through, delay = later(spark.problem, throttle.problem)
    for time in TIMES:
        tried = Exchange(gain, float(time), through, delay)
        if _kept(spark.problem, throttle.problem, law, tried, period):
            return tried
    return NoExchange(
        f"even a throttle that takes over within {TIMES[-1]:g} s leaves a pair of runs too little"
    )


def later(spark: Problem, throttle: Problem) -> tuple[tuple[tuple[float, ...], ...], int]:
    """Return M: sections, and its delay in periods."""
    slow, fast, period = throttle.model, spark.model, throttle.period
    zeros = np.concatenate((slow.zeros, fast.poles))
    poles = np.concatenate((slow.poles, -np.abs(fast.zeros.real) + 1j * fast.zeros.imag))
    missing = max(zeros.size - poles.size, 0)
    poles = np.concatenate((poles, np.full(missing, -2 * np.pi * FAST)))
    z, p, k = signal.bilinear_zpk(zeros, poles, 1.0, 1 / period)
    steady = float(np.real(k * np.prod(1 - z) / np.prod(1 - p)))
    delay = max(round((slow.delay - fast.delay) / period), 0)
    return sections(np.asarray(z, complex), np.asarray(p, complex), k / steady), delay


def _kept(
    spark: Problem, throttle: Problem, law: Command, tried: Exchange, period: float
) -> bool:  # fmt: skip
    f = spark.frequency
    command = law(f)
    through = tried.later(f, period)
    z = np.exp(2j * np.pi * f * period)
    pole = np.exp(-period / tried.time)
    taken = (1 - pole) / (1 - pole / z)
    for way in _together(spark, throttle, f, taken, through, tried.gain):
        loop = command * way
        if encircled(loop) or not throttle.required.met(margins(f, loop)):
            return False
    return _calm(throttle, f, tried.gain * taken * command / (1 + command * spark.path(f)))


def _together(
    spark: Problem, throttle: Problem, f: FloatArray, taken: ComplexArray, through: ComplexArray,
    gain: float,
) -> Iterator[ComplexArray]:  # fmt: skip
    """Every pair of members: from u to the seen slip."""
    for fast in paths(spark, f).values():
        for slow in paths(throttle, f).values():
            yield fast * (1 - taken * through) + gain * taken * slow


def _calm(throttle: Problem, f: FloatArray, command: ComplexArray) -> bool:
    """Tell whether sensor noise moves the throttle no more than it may."""
    density = 2 * throttle.told * np.sinc(f * throttle.told) ** 2
    shaken = throttle.noise * np.sqrt(np.trapezoid(np.abs(command) ** 2 * density, f))
    return bool(shaken <= throttle.required.noise * throttle.swing)

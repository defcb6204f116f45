"""A throttle with a spark that helps: as wide as every pair of measured paths allows.

    T_n = (1 - n) T_t + n T_s,   C_t = Q_t / (1 - T_n),   C_s = n (Q_s - M Q_t / k) / (1 - T_n)

T_t = G_t Q_t and T_s = G_s Q_s the throttle's and the spark's own internal model loops; C_t, C_s
what the two answer to an error (see `controllers.two_actuators`). n is how much of the spark the
dead zone passes, 0 for what is smaller than it, towards 1 for what is much larger (its describing
function): every n must keep the reserves with every pair of a spark's and a throttle's member. The
nominal S_n lies between the two loops' own, and so does its peak. The spark's corner is raised
until a pair says no. The dead zone is a few deviations of what sensor noise asks of the spark.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from slipbench.identification.design.from_runs import Path
from slipbench.identification.design.loop import Margins, encircled, margins
from slipbench.identification.design.problem import Problem
from slipbench.identification.design.sampled import answer, sampled, sections
from slipbench.identification.design.shaping import Shape, shaped
from slipbench.identification.design.steps import paths
from slipbench.identification.design.widest import (
    CORNERS,
    EXTRA_ORDERS,
    Designed,
    NoDesign,
    internal_model,
)
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

FAST = 60.0  # Hz, of poles that a model needs to be proper
PASSED = (0.0, 0.25, 0.5, 0.75, 1.0)  # of the spark, by the dead zone
ZONE = 3.0  # deviations of what noise above `from_runs.QUICK` asks for; slower noise comes on top
DEAD = 1 / 3  # of half the spark's range that the zone may take at most


@dataclass(frozen=True)
class Joint:
    """throttle, spark: internal models; later, delay: sections and periods of M; exchange: k; ways:
    problem of either. As one controller in terms of the spark: what it answers, times the spark's
    path, is the loop of both."""

    throttle: Shape
    spark: Shape
    later: tuple[tuple[float, ...], ...]
    delay: int
    exchange: float
    ways: tuple[Problem, Problem]

    def response(self, frequency: FloatArray) -> ComplexArray:
        """From error to both, in terms of the spark, at frequencies in Hz."""
        slow, fast = (p.path(frequency) for p in self.ways)
        by_throttle, by_spark = self.answers(frequency, 1.0)
        return by_spark + by_throttle * slow / fast

    def reference_response(self, frequency: FloatArray) -> ComplexArray:
        """From target to both, the loop open: a target is the throttle's alone."""
        slow, fast = (p.path(frequency) for p in self.ways)
        own = self.throttle.inverse_response(frequency) * slow
        return np.asarray(own * (1 + self.response(frequency) * fast) / fast)

    def answers(self, frequency: FloatArray, passed: float) -> tuple[ComplexArray, ComplexArray]:
        """C_t and C_s where the dead zone passes so much of the spark."""
        q_t, q_s = (s.inverse_response(frequency) for s in (self.throttle, self.spark))
        z = np.exp(2j * np.pi * np.asarray(frequency) * self.throttle.period)
        by_spark = passed * (q_s - answer(self.later, z) * z**-self.delay * q_t / self.exchange)
        whole = q_t * self.throttle.model_response(frequency)
        whole = whole + by_spark * self.spark.model_response(frequency)
        return np.asarray(q_t / (1 - whole)), np.asarray(by_spark / (1 - whole))


@dataclass(frozen=True)
class Mixture:
    """target: the throttle's own design; designed: both as one, by pair and by what the dead zone
    passes; zone: half the dead zone, rad."""

    target: Designed
    joint: Joint
    designed: Designed
    zone: float


def mixture(throttle: Path, spark: Path) -> Mixture | NoDesign:
    """Raise the spark's corner as far as every pair allows; of all orders the widest rejection.

    A spark that holds off no more than the throttle does alone gets no controller.
    """
    target = internal_model(throttle.problem)
    if isinstance(target, NoDesign):
        return NoDesign(f"through the throttle: {target.reason}")
    slow, fast = (
        target.controller,
        sampled(spark.problem.model, spark.problem.extra, spark.problem.period),
    )
    assert isinstance(slow, Shape)
    ways, widest = (throttle.problem, spark.problem), None
    reach = target.margins["nominal"].rejection
    through = (*later(spark.problem, throttle.problem), spark.gain / throttle.gain)
    for extra in EXTRA_ORDERS:
        for corner in CORNERS:
            joint = Joint(slow, shaped(fast, float(corner), extra), *through, ways)
            rejection = spark.problem.nominal(joint.response).rejection
            if rejection > reach and _allowed(joint):
                widest, reach = joint, rejection
    if widest is None:
        return NoDesign(
            f"no spark holds off more than the throttle alone ({reach:.1f} Hz) and leaves "
            "every pair of runs its reserves"
        )
    return Mixture(target, widest, _told(widest, target), ZONE * _shaken(widest)[1])


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


def _allowed(joint: Joint) -> bool:
    slow, fast = joint.ways
    by_throttle, by_spark = _shaken(joint)
    if by_throttle > slow.required.noise * slow.swing or ZONE * by_spark > DEAD * fast.swing:
        return False
    required = (slow.required, fast.required)
    return all(_robust(joint, passed) < 1.0 for passed in PASSED) and all(
        not encircled(loop) and all(r.met(margins(f, loop)) for r in required)
        for _, f, loop in _loops(joint)
    )


def _loops(joint: Joint) -> Iterator[tuple[str, FloatArray, ComplexArray]]:
    """Loop gain of every pair for whatever the dead zone passes: name, Hz, complex."""
    slow, fast = joint.ways
    f = slow.frequency
    throttles, sparks = paths(slow, f), paths(fast, f)
    for passed in PASSED:
        by_throttle, by_spark = joint.answers(f, passed)
        for one, g_t in throttles.items():
            for other, g_s in sparks.items():
                pair = "nominal" if one == other == "nominal" else f"{one}, {other}"
                part = "" if passed == 1.0 else f", {passed:.0%} of the spark"
                yield pair + part, f, by_throttle * g_t + by_spark * g_s


def _shaken(joint: Joint) -> tuple[float, float]:
    """Deviation of throttle and spark for the sensor's noise, without a dead zone."""
    slow, fast = joint.ways
    f = np.linspace(0.25, 0.5 / slow.period, 2000)
    answers = joint.answers(f, 1.0)
    around = 1 + answers[0] * slow.path(f) + answers[1] * fast.path(f)
    density = 2 * slow.told * np.sinc(f * slow.told) ** 2
    moved = [np.trapezoid(np.abs(a / around) ** 2 * density, f) for a in answers]
    return float(slow.noise * np.sqrt(moved[0])), float(slow.noise * np.sqrt(moved[1]))


def _told(joint: Joint, target: Designed) -> Designed:
    found: dict[str, Margins] = {name: margins(f, loop) for name, f, loop in _loops(joint)}
    nominal = found.pop("nominal")
    robust = max(_robust(joint, passed) for passed in PASSED)
    return replace(
        target,
        controller=joint,
        margins={"nominal": nominal} | found,
        robust=robust,
        noise=_shaken(joint)[1],
        bandwidth=target.bandwidth,
    )


def _robust(joint: Joint, passed: float) -> float:
    """Greatest |W_t C_t G_t| + |W_s C_s G_s| over 1 + L: below 1, stable for both sets together."""
    slow, fast = joint.ways
    if slow.around is None or fast.around is None:
        return 0.0
    f = slow.around.frequency
    parts = [a * p.path(f) for a, p in zip(joint.answers(f, passed), joint.ways, strict=True)]
    weights = [np.abs(p.around.weight.response(f)) for p in joint.ways if p.around is not None]
    moved = sum(w * np.abs(part) for w, part in zip(weights, parts, strict=True))
    return float(np.max(moved / np.abs(1 + parts[0] + parts[1])))

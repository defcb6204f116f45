"""Mixed control by throttle and spark: maximum bandwidth within the margins for all path pairs.

    T_n = (1 - n) T_t + n T_s,   C_t = Q_t / (1 - T_n),   C_s = n (Q_s - M Q_t / k) / (1 - T_n)

T_t = G_t Q_t and T_s = G_s Q_s are the internal model loops of throttle and spark; C_t and C_s the
responses of their commands to an error (see `controllers.two_actuators`). n is the describing
function of the dead zone: 0 for small amplitudes, towards 1 for large ones. The margins must hold
for every n and every pair of a spark and a throttle member. The nominal S_n lies between those of
the two loops, and so does its peak. The spark corner is raised until a pair violates a margin. The
dead zone is a few standard deviations of the spark command that sensor noise causes.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from slipbench.identification.design.from_runs import Path
from slipbench.identification.design.loop import Margins, encircled, margins
from slipbench.identification.design.problem import Problem
from slipbench.identification.design.sampled import sampled, sections, sections_response
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

FAST = 60.0  # Hz, of poles added to make a model proper
PASSED = (0.0, 0.25, 0.5, 0.75, 1.0)  # describing function of the dead zone
ZONE = 3.0  # standard deviations of the command noise above `from_runs.NOISE_BAND`
DEAD = 1 / 3  # largest dead zone, as a share of half the spark range


@dataclass(frozen=True)
class Joint:
    """throttle, spark: internal models; later, delay: sections and delay (periods) of M; exchange: k;
    ways: problem of either. Expressed as one equivalent spark controller: its response times the
    spark path is the loop gain of both."""

    throttle: Shape
    spark: Shape
    later: tuple[tuple[float, ...], ...]
    delay: int
    exchange: float
    ways: tuple[Problem, Problem]

    def response(self, frequency: FloatArray) -> ComplexArray:
        """Response from error to the equivalent spark command. frequency: Hz, shape (n,)."""
        slow, fast = (p.path(frequency) for p in self.ways)
        by_throttle, by_spark = self.responses(frequency, 1.0)
        return by_spark + by_throttle * slow / fast

    def reference_response(self, frequency: FloatArray) -> ComplexArray:
        """Open-loop response from setpoint to the equivalent spark command, complex, shape (n,).

        frequency: Hz, shape (n,). The throttle tracks the setpoint.
        """
        slow, fast = (p.path(frequency) for p in self.ways)
        own = self.throttle.inverse_response(frequency) * slow
        return np.asarray(own * (1 + self.response(frequency) * fast) / fast)

    def responses(self, frequency: FloatArray, passed: float) -> tuple[ComplexArray, ComplexArray]:
        """C_t and C_s for a dead zone with the describing function `passed`. frequency: Hz, (n,)."""
        q_t, q_s = (s.inverse_response(frequency) for s in (self.throttle, self.spark))
        z = np.exp(2j * np.pi * np.asarray(frequency) * self.throttle.period)
        by_spark = passed * (
            q_s - sections_response(self.later, z) * z**-self.delay * q_t / self.exchange
        )
        whole = q_t * self.throttle.model_response(frequency)
        whole = whole + by_spark * self.spark.model_response(frequency)
        return np.asarray(q_t / (1 - whole)), np.asarray(by_spark / (1 - whole))


@dataclass(frozen=True)
class Mixture:
    """target: design of the throttle alone; designed: both together, margins by pair and describing
    function; zone: half width of the dead zone, rad."""

    target: Designed
    joint: Joint
    designed: Designed
    zone: float


def mixture(throttle: Path, spark: Path) -> Mixture | NoDesign:
    """Mixed design with the highest rejection bandwidth that every pair of members allows.

    NoDesign where the spark does not improve on the throttle alone.
    """
    target = internal_model(throttle.problem)
    if isinstance(target, NoDesign):
        return NoDesign(f"throttle: {target.reason}")
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
            f"no spark controller rejects disturbances to more than {reach:.1f} Hz, which the throttle "
            "reaches alone, within the margins of every pair of runs"
        )
    return Mixture(target, widest, _evaluated(widest, target), ZONE * _command_noise(widest)[1])


def later(spark: Problem, throttle: Problem) -> tuple[tuple[tuple[float, ...], ...], int]:
    """Second-order sections of M, and its delay in periods."""
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
    by_throttle, by_spark = _command_noise(joint)
    if (
        by_throttle > slow.required.noise * slow.half_range
        or ZONE * by_spark > DEAD * fast.half_range
    ):
        return False
    required = (slow.required, fast.required)
    return all(_robust(joint, passed) < 1.0 for passed in PASSED) and all(
        not encircled(loop) and all(r.met(margins(f, loop)) for r in required)
        for _, f, loop in _loops(joint)
    )


def _loops(joint: Joint) -> Iterator[tuple[str, FloatArray, ComplexArray]]:
    """Name, frequencies (Hz) and loop gain of every pair and describing function."""
    slow, fast = joint.ways
    f = slow.frequency
    throttles, sparks = paths(slow, f), paths(fast, f)
    for passed in PASSED:
        by_throttle, by_spark = joint.responses(f, passed)
        for one, g_t in throttles.items():
            for other, g_s in sparks.items():
                pair = "nominal" if one == other == "nominal" else f"{one}, {other}"
                part = "" if passed == 1.0 else f", spark gain {passed:.0%}"
                yield pair + part, f, by_throttle * g_t + by_spark * g_s


def _command_noise(joint: Joint) -> tuple[float, float]:
    """Standard deviation of throttle and spark due to sensor noise, without dead zone."""
    slow, fast = joint.ways
    f = np.linspace(0.25, 0.5 / slow.period, 2000)
    responses = joint.responses(f, 1.0)
    around = 1 + responses[0] * slow.path(f) + responses[1] * fast.path(f)
    density = 2 * slow.sample_interval * np.sinc(f * slow.sample_interval) ** 2
    moved = [np.trapezoid(np.abs(a / around) ** 2 * density, f) for a in responses]
    return float(slow.noise * np.sqrt(moved[0])), float(slow.noise * np.sqrt(moved[1]))


def _evaluated(joint: Joint, target: Designed) -> Designed:
    found: dict[str, Margins] = {name: margins(f, loop) for name, f, loop in _loops(joint)}
    nominal = found.pop("nominal")
    robust = max(_robust(joint, passed) for passed in PASSED)
    return replace(
        target,
        controller=joint,
        margins={"nominal": nominal} | found,
        robust=robust,
        noise=_command_noise(joint)[1],
        bandwidth=target.bandwidth,
    )


def _robust(joint: Joint, passed: float) -> float:
    """Largest (|W_t C_t G_t| + |W_s C_s G_s|) / |1 + L|; below 1: stable for both sets together."""
    slow, fast = joint.ways
    if slow.around is None or fast.around is None:
        return 0.0
    f = slow.around.frequency
    parts = [a * p.path(f) for a, p in zip(joint.responses(f, passed), joint.ways, strict=True)]
    weights = [np.abs(p.around.weight.response(f)) for p in joint.ways if p.around is not None]
    moved = sum(w * np.abs(part) for w, part in zip(weights, parts, strict=True))
    return float(np.max(moved / np.abs(1 + parts[0] + parts[1])))

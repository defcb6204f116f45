"""Tooth-pitch errors of a wheel, estimated while it turns.

A disc's teeth are not equally far apart, but they stay where they are. The fixed-position formula
takes 2 pi / N for every gap; gap j is really (1 + g_j) 2 pi / N, so the speed that it shows is
w / (1 + g_j), the same error in every turn: the 1X family. In logarithms,

    log(2 pi / (N TT_k)) = log w_k - log(1 + g_j),    j = k mod N

What is slow in w goes out with (1 - M)^2, M the mean over one full turn: that leaves any pattern of
gaps exactly as it is. The response to a known input is removed by a finite impulse response, fitted
together with the gaps, so that an excitation that turns with the wheel is not taken for a tooth.
The residual is noise; its size is estimated turn by turn and gives the weight of the turn.

Not distinguishable from a tooth-pitch error is whatever else turns with the wheel and grows with its speed, such as a
tyre that is out of round; nor an input that keeps to the wheel's order throughout the recording.
The latter shows in the standard errors, which then are large, and is refused.

    found = learn_pitch(time, count, 16)
    if isinstance(found, ToothPitch):
        speed = speed_from_teeth(time, count, 16, gaps=found.gaps)

Errors: sandwich covariance over batches of turns (Liang and Zeger 1986), which needs not know the
noise's colour; Student's t with one degree of freedom less than batches.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import signal, stats

from slipbench.identification.signals.tooth_evidence import Answers, Evidence, evidence
from slipbench.protocol.recording.channel import FloatArray

LEAST_TURNS = 20
MOST_DEVIATION = 2e-3  # of a pitch, standard error above which a correction would add noise
ROUNDS = 5  # of reweighting; the estimates then move by less than a hundredth of their error
OUTLIER = 3.0  # deviations from which a tooth interval loses weight (Huber)
CROOKED = 0.1  # share of the response to an input that is assumed to be nonlinear
BATCHES = 24


@dataclass(frozen=True)
class ToothPitch:
    """Gaps of a toothed disc.

    gaps       (N,) 1, g_j: how much longer than even the gap is that begins with tooth j, where
               tooth j has running counts k with k mod N = j; they add up to nothing
    deviation  (N,) 1, standard errors of the gaps
    covariance (N, N) 1, of the gaps
    quantile   two-sided 95 % quantile that belongs to the errors
    turns      of the wheel that were used, weighed by how quiet they were
    """

    gaps: FloatArray
    deviation: FloatArray
    covariance: FloatArray
    quantile: float
    turns: float

    @property
    def teeth(self) -> int:
        """Teeth of the disc."""
        return int(self.gaps.size)

    @property
    def positions(self) -> FloatArray:
        """Delay of every tooth against even spacing, rad, (N,); the mean, unknowable, is 0."""
        late = np.concatenate(([0.0], np.cumsum(self.gaps)[:-1])) * 2 * np.pi / self.teeth
        return np.asarray(late - late.mean())

    def line(self, order: int) -> float:
        """Amplitude of one order in the speed that equal gaps would show, over the speed."""
        return order_of_gaps(self.gaps, order)


@dataclass(frozen=True)
class NoToothPitch:
    """Why the gaps are not known."""

    reason: str


def learn_pitch(
    time: FloatArray, count: FloatArray, teeth: int, inputs: Sequence[Answers] = ()
) -> ToothPitch | NoToothPitch:
    """Learn the gaps from tooth times. time: s, (n,); count: running, lost teeth as steps, (n,).

    inputs: inputs of the vehicle, whose response is not to be taken for a tooth-pitch error.
    """
    if teeth < 2:
        return NoToothPitch(f"{teeth} tooth in a turn: there is nothing to compare")
    intervals = evidence(time, count, teeth, inputs)
    turns = intervals.value.size / teeth
    if (
        turns < LEAST_TURNS
        or np.bincount(intervals.tooth, minlength=teeth).min() < LEAST_TURNS // 2
    ):
        return NoToothPitch(f"{turns:.0f} turns without a lost tooth, {LEAST_TURNS} are needed")
    found = _fitted(intervals, teeth)
    worst = float(found.deviation.max())
    if not worst <= MOST_DEVIATION:
        return NoToothPitch(
            f"the gaps would be known to {100 * worst:.2g} % of a pitch only, "
            f"{100 * MOST_DEVIATION:g} % are needed: the wheel's motion is too restless, "
            "or the excitation turns with the wheel"
        )
    return found


def order_of_gaps(gaps: FloatArray, order: int) -> float:
    """Amplitude of one order in the speed that equal gaps would show, over the speed. gaps: (N,).

    A gap shows w / (1 + g) and lasts (1 + g) as long as an even one, so over the angle of the wheel
    the error that it contributes is g itself: 2 / N abs(sum g_j exp(-2 pi i m j / N)).
    """
    wave = np.exp(-2j * np.pi * order * np.arange(gaps.size) / gaps.size)
    return float(2 * abs(np.mean(gaps * wave)))


def _fitted(intervals: Evidence, teeth: int) -> ToothPitch:
    """Weighted least squares; the weights follow the residual, turn by turn."""
    weight = np.ones(intervals.value.size)
    prior = _prior(intervals)
    for _ in range(ROUNDS):
        normal, moment = _normal(intervals, weight, teeth)
        normal[teeth:, teeth:] += prior
        level = np.asarray(np.linalg.solve(normal, moment), np.float64)
        response = intervals.delayed @ level[teeth:]
        residual = intervals.value - level[intervals.tooth] - response
        weight = _weights(residual, response, intervals)
    normal, _ = _normal(intervals, weight, teeth)
    normal[teeth:, teeth:] += prior
    cov = _covariance(intervals, weight * residual, normal, prior, teeth)
    return _pitch(level[:teeth], cov, intervals, weight)


def _pitch(
    level: FloatArray, cov: FloatArray, intervals: Evidence, weight: FloatArray
) -> ToothPitch:
    """Levels -log(1 + g) become gaps that add up to nothing."""
    n = level.size
    ratio = np.exp(-level)
    ratio *= n / ratio.sum()
    slope = ratio[:, None] * (np.eye(n) - ratio[None, :] / n)
    cov = slope @ cov @ slope.T
    quantile = float(stats.t.ppf(0.975, min(BATCHES, intervals.batches) - 1))
    turns = float(weight.sum() ** 2 / (weight**2).sum() / n)
    return ToothPitch(ratio - 1, np.sqrt(np.diag(cov)), cov, quantile, turns)


def _normal(intervals: Evidence, weight: FloatArray, teeth: int) -> tuple[FloatArray, FloatArray]:
    """Weighted normal equations of N levels and the taps of the response."""
    size = teeth + intervals.delayed.shape[1]
    normal, moment = np.zeros((size, size)), np.zeros(size)
    normal[range(teeth), range(teeth)] = np.bincount(intervals.tooth, weight, teeth)
    moment[:teeth] = np.bincount(intervals.tooth, weight * intervals.value, teeth)
    heavy = weight[:, None] * intervals.delayed
    for tap in range(intervals.delayed.shape[1]):
        normal[:teeth, teeth + tap] = np.bincount(intervals.tooth, heavy[:, tap], teeth)
    normal[teeth:, :teeth] = normal[:teeth, teeth:].T
    normal[teeth:, teeth:] = intervals.delayed.T @ heavy
    moment[teeth:] = heavy.T @ intervals.value
    return normal, moment


def _prior(intervals: Evidence) -> FloatArray:
    """Prior of the taps: each alone might explain all of the motion."""
    share = np.var(intervals.delayed, axis=0)
    size = max(float(np.var(intervals.value)), 1e-16)
    return np.diag(share / size)


def _weights(residual: FloatArray, response: FloatArray, intervals: Evidence) -> FloatArray:
    """One over the local variance over about four turns; single outliers count less."""
    square = np.minimum(residual**2, 1.0) + (CROOKED * response) ** 2
    local = (
        np.maximum(signal.fftconvolve(square, intervals.window, mode="same"), 0.0)
        + intervals.timer**2
    )
    excess = np.abs(residual) / np.sqrt(local)
    return np.asarray(np.minimum(1.0, OUTLIER / np.maximum(excess, 1e-12)) / local)


def _covariance(
    intervals: Evidence, score: FloatArray, normal: FloatArray, prior: FloatArray, teeth: int
) -> FloatArray:
    """Covariance of the levels: A^-1 (S + prior) A^-1 with S from batches of turns."""
    batch = np.arange(score.size) * min(BATCHES, intervals.batches) // score.size
    rows = [
        np.concatenate(
            (np.bincount(intervals.tooth[b], score[b], teeth), intervals.delayed[b].T @ score[b])
        )
        for b in (batch == k for k in range(batch[-1] + 1))
    ]
    scores = np.array(rows)
    meat = scores.T @ scores * scores.shape[0] / (scores.shape[0] - 1)
    meat[teeth:, teeth:] += prior
    inverse = np.linalg.inv(normal)
    return np.asarray((inverse @ meat @ inverse)[:teeth, :teeth])

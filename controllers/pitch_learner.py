"""Tooth-pitch errors estimated online, tooth by tooth, for a controller.

The same estimate as identification makes of a whole recording, recursively: with each tooth the
interval of one turn ago is freed of what is slow and moves its gap's estimate, the less the more
is known and the more restless the wheel is. The present interval is corrected at once: that costs
no phase. Inputs are not explained here; do not learn while an excitation turns with the wheel
(`learning=False`).

    learner = PitchLearner(16)
    state = learner.initial()
    speed, state = learner.update(state, time, count)      # at every tooth; NaN after a lost one
"""

import math
from dataclasses import dataclass, replace
from functools import cache
from operator import mul

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Numbers = tuple[float, ...]
STANDING_AFTER = 0.5  # s without a tooth
TIMER = 1e-6  # s, resolution of the encoders' timers

OUTLIER = 3.0  # deviations to which a surprise is cut


@dataclass(frozen=True, slots=True)
class LearnerState:
    """State after a tooth; tuples of numbers, which a loop reads quickly.

    time, count  of the last tooth; NaN at first
    logs         2 N + 1 log speeds of the last intervals, the newest last
    filled       how many of them follow each other without a lost tooth
    level        N, log of the speed that gap j shows, over the true one
    share        N, exp(-level): each gap in proportion to the others
    weight       N, one over the variance of each level; 0 where nothing is known
    variance     of the wheel's restlessness, over about four turns
    """

    time: float
    count: float
    logs: Numbers
    filled: int
    level: Numbers
    share: Numbers
    weight: Numbers
    variance: float

    @property
    def gaps(self) -> FloatArray:
        """g_j, (N,): how much longer than even each gap is."""
        share = np.array(self.share)
        return np.asarray(share * share.size / share.sum() - 1)

    @property
    def deviation(self) -> FloatArray:
        """Standard errors of the gaps, (N,), if the wheel's restlessness has no colour."""
        return np.asarray(1 / np.sqrt(np.maximum(self.weight, 1e-12)))


@dataclass(frozen=True, slots=True)
class PitchLearner:
    """teeth: of one turn; memory: turns after which a tooth is half forgotten (a disc may bend);
    ready: standard error of all gaps below which they are used."""

    teeth: int
    memory: float = 20_000.0
    ready: float = 2e-3

    def initial(self) -> LearnerState:
        """State before the first tooth."""
        n = self.teeth
        none = (0.0,) * n
        return LearnerState(
            math.nan, math.nan, (0.0,) * (2 * n + 1), 0, none, (1.0,) * n, none, 1e-2
        )

    def update(
        self, state: LearnerState, time: float, count: float, learning: bool = True
    ) -> tuple[float, LearnerState]:
        """Take one tooth in. Returns the wheel's speed over the last interval, rad/s, and state."""
        interval = time - state.time
        if count - state.count != 1 or not 0 < interval < STANDING_AFTER:
            return math.nan, replace(state, time=time, count=count, filled=0)
        logs = (*state.logs[1:], -math.log(interval))
        filled = min(state.filled + 1, len(logs))
        level, share, weight, variance = (
            self._learnt(state, logs, int(count - 1) % self.teeth, interval)
            if learning and filled == len(logs)
            else (state.level, state.share, state.weight, state.variance)
        )
        state = LearnerState(time, count, logs, filled, level, share, weight, variance)
        return self.angle(state, count - 1) / interval, state

    def angle(self, state: LearnerState, count: float) -> float:
        """Angle of the gap after tooth `count`, rad; even while the gaps are not well known."""
        if not min(state.weight) * self.ready**2 > 1:
            return 2 * math.pi / self.teeth
        return 2 * math.pi * state.share[int(count) % self.teeth] / sum(state.share)

    def _learnt(
        self, state: LearnerState, logs: Numbers, tooth: int, interval: float
    ) -> tuple[Numbers, Numbers, Numbers, float]:
        """Move the level of the interval one turn ago: its tooth was the same."""
        level, weight = state.level[tooth], state.weight[tooth]
        observed = _centre(logs, self.teeth)
        limit = OUTLIER * math.sqrt(state.variance + 1 / weight) if weight > 0 else math.inf
        surprise = max(-limit, min(limit, observed - level))
        pace = 1 / (4 * self.teeth) if weight > 0 else 0.0
        variance = state.variance + pace * (surprise**2 - state.variance)
        gain = 1 / (variance + TIMER**2 / 6 / interval**2)
        weight = weight * 0.5 ** (1 / self.memory) + gain
        level += gain / weight * surprise
        return (
            _with(state.level, tooth, level),
            _with(state.share, tooth, math.exp(-level)),
            _with(state.weight, tooth, weight),
            variance,
        )


def _with(values: Numbers, place: int, value: float) -> Numbers:
    return (*values[:place], value, *values[place + 1 :])


def _centre(logs: Numbers, teeth: int) -> float:
    """Remove the slow part from the middle interval."""
    kernel = _quick(teeth)
    spare = (len(logs) - len(kernel)) // 2
    return float(sum(map(mul, kernel, logs[spare:])))


@cache
def _quick(teeth: int) -> Numbers:
    return tuple(quick(teeth).tolist())


@cache
def quick(teeth: int) -> FloatArray:
    """Kernel of (1 - M)^2, M the centred mean over a revolution; dimensionless, read-only.

    Gain 1 at every wheel order, 0 at zero frequency. Shape (2 n - 1,), n = `teeth`, made odd.
    """
    mean = np.ones(teeth) / teeth
    if teeth % 2 == 0:
        mean = np.convolve(mean, [0.5, 0.5])
    less = -mean
    less[mean.size // 2] += 1
    kernel = np.convolve(less, less)
    kernel.flags.writeable = False
    return kernel

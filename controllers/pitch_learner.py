"""The gaps between teeth learnt while riding, tooth by tooth, for a controller.

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

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
STANDING_AFTER = 0.5  # s without a tooth
TIMER = 1e-6  # s, resolution of the encoders' timers

OUTLIER = 3.0  # deviations to which a surprise is cut


@dataclass(frozen=True)
class LearnerState:
    """What is known after a tooth.

    time, count  of the last tooth; NaN at first
    logs         (2 N + 1,) log speeds of the last intervals, the newest last
    filled       how many of them follow each other without a lost tooth
    level        (N,) log of the speed that gap j shows, over the true one
    weight       (N,) one over the variance of each level; 0 where nothing is known
    variance     of the wheel's restlessness, over about four turns
    """

    time: float
    count: float
    logs: FloatArray
    filled: int
    level: FloatArray
    weight: FloatArray
    variance: float

    @property
    def gaps(self) -> FloatArray:
        """g_j, (N,): how much longer than even each gap is."""
        ratio = np.exp(-self.level)
        return np.asarray(ratio * ratio.size / ratio.sum() - 1)

    @property
    def deviation(self) -> FloatArray:
        """Standard errors of the gaps, (N,), if the wheel's restlessness has no colour."""
        return np.asarray(1 / np.sqrt(np.maximum(self.weight, 1e-12)))


@dataclass(frozen=True)
class PitchLearner:
    """teeth: of one turn; memory: turns after which a tooth is half forgotten (a disc may bend);
    ready: standard error of all gaps below which they are used."""

    teeth: int
    memory: float = 20_000.0
    ready: float = 2e-3

    def initial(self) -> LearnerState:
        """Know nothing."""
        n = self.teeth
        return LearnerState(
            math.nan, math.nan, np.zeros(2 * n + 1), 0, np.zeros(n), np.zeros(n), 1e-2
        )

    def update(
        self, state: LearnerState, time: float, count: float, learning: bool = True
    ) -> tuple[float, LearnerState]:
        """Take one tooth in. Returns the wheel's speed over the last interval, rad/s, and state."""
        interval = time - state.time
        if count - state.count != 1 or not 0 < interval < STANDING_AFTER:
            return math.nan, replace(state, time=time, count=count, filled=0)
        logs = np.append(state.logs[1:], -math.log(interval))
        filled = min(state.filled + 1, logs.size)
        state = replace(state, time=time, count=count, logs=logs, filled=filled)
        if learning and filled == logs.size:
            state = self._learnt(state, interval)
        return self.angle(state, count - 1) / interval, state

    def angle(self, state: LearnerState, count: float) -> float:
        """Angle of the gap after tooth `count`, rad; even while the gaps are not well known."""
        gap = state.gaps[int(count) % self.teeth] if self._ready(state) else 0.0
        return float(2 * math.pi / self.teeth * (1 + gap))

    def _ready(self, state: LearnerState) -> bool:
        return bool(state.weight.min() * self.ready**2 > 1)

    def _learnt(self, state: LearnerState, interval: float) -> LearnerState:
        """Move the level of the interval one turn ago."""
        tooth = int(state.count - 1) % self.teeth  # one turn ago it was the same
        seen = _centre(state.logs, self.teeth)
        level, weight = state.level.copy(), state.weight * 1.0
        known = weight[tooth] > 0
        limit = OUTLIER * math.sqrt(state.variance + 1 / weight[tooth]) if known else math.inf
        surprise = max(-limit, min(limit, seen - level[tooth]))
        pace = 1 / (4 * self.teeth)
        variance = state.variance + (pace * (surprise**2 - state.variance) if known else 0.0)
        gain = 1 / (variance + TIMER**2 / 6 / interval**2)
        weight[tooth] = weight[tooth] * 0.5 ** (1 / self.memory) + gain
        level[tooth] += gain / weight[tooth] * surprise
        return replace(state, level=level, weight=weight, variance=variance)


def _centre(logs: FloatArray, teeth: int) -> float:
    """Free the middle interval of what is slow."""
    kernel = quick(teeth)
    spare = (logs.size - kernel.size) // 2
    return float(kernel @ logs[spare : logs.size - spare])


@cache
def quick(teeth: int) -> FloatArray:
    """(1 - M)^2 with M the centred mean over one turn: 1 at every order, 0 at zero frequency."""
    mean = np.ones(teeth) / teeth
    if teeth % 2 == 0:
        mean = np.convolve(mean, [0.5, 0.5])
    less = -mean
    less[mean.size // 2] += 1
    kernel = np.convolve(less, less)
    kernel.flags.writeable = False
    return kernel

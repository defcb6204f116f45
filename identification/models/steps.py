"""Step responses from a square wave: opening and closing steps, aligned at the echoed command.

Each full step of the command is one experiment. Averaged, they show what differs between opening
and closing; their scatter gives the uncertainty (Corno and Savaresi 2009, steps of figure 8).

    found = identify(run_folder.read(path))
    steps = steps_of(found)                 # Steps, or NoSteps with the reason
    steps.opening.mean - steps.closing.mean * -1
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipbench.identification.response.identify import Identification
from slipbench.identification.response.responses import INPUTS, excited_actuator
from slipbench.identification.signals.filters import bridged
from slipbench.identification.signals.motion import NoMotion
from slipbench.identification.signals.trial_window import NoExcitation
from slipbench.protocol.recording.channel import FloatArray

BEFORE = 0.10  # s kept before a step
FEWEST = 4  # steps in each direction; fewer give no variance estimate
MOVED = 0.01  # of the amplitude: less is rest
SHORTEST = 0.30  # s between two steps, so that the response to one is over at the next


@dataclass(frozen=True)
class Bundle:
    """Steps in one direction, each relative to its own mean before the step.

    input, output  (steps, n) change of the command and of the output, their own units
    """

    input: FloatArray
    output: FloatArray

    @property
    def mean(self) -> FloatArray:
        """Mean response, (n,)."""
        return np.asarray(self.output.mean(axis=0))

    @property
    def deviation(self) -> FloatArray:
        """Standard deviation of the mean response, (n,), from the scatter between steps."""
        spread = self.output.std(axis=0, ddof=1)
        return np.asarray(spread / np.sqrt(len(self.output)))

    @property
    def size(self) -> float:
        """Height of the step, signed, in the command's unit."""
        return float(np.median(self.input[:, -self.input.shape[1] // 4 :]))


@dataclass(frozen=True)
class Steps:
    """Opening and closing steps on one time axis.

    time  (n,) s, zero where the command passes the middle of its range; rate: Hz
    """

    time: FloatArray
    rate: float
    opening: Bundle
    closing: Bundle


@dataclass(frozen=True)
class NoSteps:
    """Why there are no step responses."""

    reason: str


def steps_of(found: Identification, output: str = "slip") -> Steps | NoSteps:
    """Cut the steps out of a square-wave trial. output: "slip" or a role of the recording."""
    if isinstance(found.motion, NoMotion):
        return NoSteps(found.motion.reason)
    if isinstance(found.window, NoExcitation):
        return NoSteps(found.window.reason)
    command = INPUTS[excited_actuator(found.recording.trial, found.base, found.window)][0]
    u = found.base.get(command)
    y = found.motion.slip.ratio if output == "slip" else found.base.get(output)
    if u is None or y is None:
        return NoSteps(f"{command if u is None else output} was not recorded")
    part = found.window.exciting
    return step_responses(bridged(u)[part], bridged(y)[part], found.base.rate)


def step_responses(u: FloatArray, y: FloatArray, rate: float) -> Steps | NoSteps:
    """Cut opening and closing steps out of a square wave's command and the response.

    u, y: (n,) without unknown samples; rate: Hz. Only steps over the full range count, so that
    the first step from the middle and the last back to it are left out.
    """
    rising, falling = _crossings(u)
    every = np.sort(np.concatenate((rising, falling)))
    if min(rising.size, falling.size) < FEWEST + 1:
        return NoSteps(
            f"{rising.size} opening and {falling.size} closing steps, "
            f"at least {FEWEST + 1} of each are needed"
        )
    length = float(np.diff(every).min()) / rate
    if length < SHORTEST:
        return NoSteps(f"{length:.2f} s between steps, at least {SHORTEST:g} s are needed")
    lasts = length - BEFORE - 0.02
    time = np.arange(-round(BEFORE * rate), round(lasts * rate)) / rate
    opening, closing = (_bundle(u, y, at, time, rate) for at in (rising, falling))
    fewest = min(len(opening.output), len(closing.output))
    if fewest < FEWEST:
        return NoSteps(f"{fewest} steps over the whole height, at least {FEWEST} are needed")
    return Steps(time, rate, opening, closing)


def mean_levels(
    u: FloatArray, y: FloatArray, rate: float, like: Steps
) -> tuple[FloatArray, FloatArray]:
    """Mean of a signal about the opening and about the closing steps, its level kept. (n,) each."""
    opening, closing = (_cut(u, y, at, like.time, rate)[1] for at in _crossings(u))
    return opening.mean(axis=0), closing.mean(axis=0)


def pooled(parts: Sequence[Steps]) -> Steps:
    """Pool the steps of several like trials; the shortest sets the length.

    Raises ValueError where rates or starts differ.
    """
    start = max(part.time[0] for part in parts)
    count = min(part.time.size for part in parts)
    if any(part.rate != parts[0].rate or part.time[0] != start for part in parts):
        raise ValueError("steps of different rates cannot be pooled")
    opening, closing = (
        Bundle(*(np.vstack([getattr(b, k)[:, :count] for b in side]) for k in ("input", "output")))
        for side in ([p.opening for p in parts], [p.closing for p in parts])
    )
    return Steps(parts[0].time[:count], parts[0].rate, opening, closing)


def _crossings(u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sample positions, fractions included, at which the command changes its level: up, down.

    A level is the outer quarter of the range; rest in the middle is none.
    """
    low, high = np.percentile(u, (10, 90))
    above = u - (low + high) / 2
    level = np.where(np.abs(above) > (high - low) / 4, np.sign(above), 0.0)
    on = np.flatnonzero(level)
    change = np.flatnonzero(np.diff(level[on]))
    at = np.array([_middle(above, *on[i : i + 2]) for i in change])
    upwards = level[on][change] < 0
    return at[upwards], at[~upwards]


def _middle(above: FloatArray, start: int, stop: int) -> float:
    """Position of the zero crossing between two samples that lie on either side."""
    part = above[start : stop + 1]
    first = int(np.flatnonzero(np.sign(part) != np.sign(part[0]))[0])
    return float(start + first - 1 + part[first - 1] / (part[first - 1] - part[first]))


def _bundle(u: FloatArray, y: FloatArray, at: FloatArray, time: FloatArray, rate: float) -> Bundle:
    """Read command and response about every full step, relative to before it began to move."""
    inputs, outputs = _cut(u, y, at, time, rate)
    moved = np.abs(inputs - inputs[:, :1]) > MOVED * np.ptp(inputs, axis=1, keepdims=True)
    rest = slice(max(int(np.argmax(moved.any(axis=0))) - 1, 1))
    return Bundle(*(x - x[:, rest].mean(axis=1, keepdims=True) for x in (inputs, outputs)))


def _cut(
    u: FloatArray, y: FloatArray, at: FloatArray, time: FloatArray, rate: float
) -> tuple[FloatArray, FloatArray]:
    """Command and response about every step over the whole height, (steps, n) each."""
    index = np.arange(u.size)
    places = at[:, None] + time * rate
    places = places[(places[:, 0] >= 0) & (places[:, -1] <= u.size - 1)]
    inputs, outputs = (np.interp(places, index, x) for x in (u, y))
    full = np.ptp(inputs, axis=1) > 0.9 * np.ptp(inputs, axis=1).max(initial=0.0)
    return inputs[full], outputs[full]

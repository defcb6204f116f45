"""The periodic loop: deadlines are absolute; each tick is sent, late, refused or skipped."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slipbench.bench.loop.clock import Clock

MOST_TICKS = 3_600_000  # for which there is room: an hour of ticks of 1 ms
LAST_TICK = MOST_TICKS - 1000  # after it there is only time to hand back and to say so

# A tick is told its number and the time at which it was due; it answers whether to go on.
Tick = Callable[[int, int], bool]
# Waits until a deadline (ns), or answers True earlier: then the next tick is due now.
Wait = Callable[[int], bool]
# Is told of each tick once it ran: its number, when it was due, how late it began (ns), and whether
# what it sent was refused.
TickObserver = Callable[[int, int, int, bool], None]


@dataclass(frozen=True)
class Lateness:
    """What became of every tick.

    tick      (n,) int64, number of each tick that ran, increasing
    lateness  (n,) int64, ns from when it was due to when it began
    period    ns
    start     ns, when tick 0 was due, or would have been where the ticks began anew since
    refused   (n,) bool, whether the bus refused what the tick sent
    """

    tick: npt.NDArray[np.int64]
    lateness: npt.NDArray[np.int64]
    period: int
    start: int
    refused: npt.NDArray[np.bool_]

    @property
    def due(self) -> int:
        """Count the ticks that fell due."""
        return int(self.tick[-1]) + 1 if self.tick.size else 0

    @property
    def skipped(self) -> int:
        """Count the ticks that were past before they could run."""
        return self.due - int(self.tick.size)

    def quantiles(self) -> dict[str, float]:
        """Give lateness at p50, p99, p99.9 and the maximum, in s."""
        if not self.tick.size:
            return {}
        names = {"p50": 50.0, "p99": 99.0, "p99_9": 99.9, "max": 100.0}
        return {key: float(np.percentile(self.lateness, q)) * 1e-9 for key, q in names.items()}


def no_observer(_number: int, _due: int, _late: int, _refused: bool) -> None:
    """Take no note of a tick."""


def not_refused() -> bool:
    """Tell that nothing is refused."""
    return False


class _TickHistory:
    """Arrays for the ticks that run, allocated before the first one."""

    def __init__(self, most: int) -> None:
        self._number, self._lateness = np.empty(most, np.int64), np.empty(most, np.int64)
        self._refused = np.zeros(most, np.bool_)
        self._ran = 0

    def add(self, number: int, lateness: int, refused: bool) -> None:
        """Append a tick that ran."""
        self._number[self._ran], self._lateness[self._ran] = number, lateness
        self._refused[self._ran] = refused
        self._ran += 1

    def finished(self, period: int, start: int) -> Lateness:
        """Lateness of the ticks added so far; period, start: ns."""
        ran = slice(self._ran)
        columns = (self._number[ran].copy(), self._lateness[ran].copy())
        return Lateness(*columns, period, start, self._refused[ran].copy())


def run_periodic(
    tick: Tick,
    period: int,
    clock: Clock,
    most: int = MOST_TICKS,
    observer: TickObserver = no_observer,
    wait: Wait | None = None,
    refused: Callable[[], bool] = not_refused,
) -> Lateness:
    """Run `tick` every `period` ns as `run_ticks` does, and return the lateness of every tick.

    The arrays for `most` ticks are allocated before the first tick: 17 bytes a tick.
    """
    history = _TickHistory(most)

    def noted(number: int, due: int, late: int, unsent: bool) -> None:
        history.add(number, late, unsent)
        observer(number, due, late, unsent)

    start = run_ticks(tick, period, clock, most, noted, wait, refused)
    return history.finished(period, start)


def run_ticks(
    tick: Tick,
    period: int,
    clock: Clock,
    most: float = math.inf,
    observer: TickObserver = no_observer,
    wait: Wait | None = None,
    refused: Callable[[], bool] = not_refused,
) -> int:
    """Run `tick` every `period` ns until it returns False or `most` ticks fell due; keep nothing.

    A late tick runs at once with its own number; ticks that are wholly past are skipped, so the
    value sent is always the one that is due now. Where `wait` returns early the next tick is due at
    that moment, and later ones a period apart from there. `refused` is whether the bus refused what
    the last tick sent. Returns when tick 0 was due, ns, as `Lateness.start`.
    """
    start = clock.now_ns() + period
    number = 0
    while number < most:
        if wait is None:
            clock.sleep_until_ns(start + number * period)
        elif wait(start + number * period):
            start = min(start, clock.now_ns() - number * period)
        late = clock.now_ns() - (start + number * period)
        if late >= period:
            number += late // period
            late %= period
        due = start + number * period
        goes_on = tick(number, due)
        observer(number, due, late, refused())
        if not goes_on:
            break
        number += 1
    return start

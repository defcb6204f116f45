"""Periodic loop with absolute deadlines; each tick is sent, late, refused or skipped."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slipbench.bench.loop.clock import Clock

MOST_TICKS = 3_600_000  # capacity: an hour of ticks of 1 ms
LAST_TICK = MOST_TICKS - 1000  # after it there is only time to return control to the rider

# (number, due time in ns) -> whether the loop continues.
Tick = Callable[[int, int], bool]
# (deadline in ns) -> False at the deadline, or True earlier: then the next tick is due at once.
Wait = Callable[[int], bool]
# (number, due time in ns, lateness in ns, whether the bus refused its frame); called after each tick.
TickObserver = Callable[[int, int, int, bool], None]


@dataclass(frozen=True)
class Lateness:
    """Lateness of every tick of a loop.

    tick      (n,) int64, number of each tick that ran, increasing
    lateness  (n,) int64, ns from the due time of the tick to its begin
    period    ns
    start     ns, due time of tick 0, extrapolated back where the ticks were restarted
    refused   (n,) bool, whether the bus refused the frame of the tick
    """

    tick: npt.NDArray[np.int64]
    lateness: npt.NDArray[np.int64]
    period: int
    start: int
    refused: npt.NDArray[np.bool_]

    @property
    def due(self) -> int:
        """Number of ticks that were due."""
        return int(self.tick[-1]) + 1 if self.tick.size else 0

    @property
    def skipped(self) -> int:
        """Number of ticks that did not run because they were a whole period late."""
        return self.due - int(self.tick.size)

    def quantiles(self) -> dict[str, float]:
        """Lateness in s at p50, p99, p99.9 and the maximum; empty without ticks."""
        if not self.tick.size:
            return {}
        names = {"p50": 50.0, "p99": 99.0, "p99_9": 99.9, "max": 100.0}
        return {key: float(np.percentile(self.lateness, q)) * 1e-9 for key, q in names.items()}


def no_observer(_number: int, _due: int, _late: int, _refused: bool) -> None:
    """Do nothing after a tick."""


def not_refused() -> bool:
    """Return False: no frame was refused."""
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
    """Lateness of every tick, after running `tick` every `period` ns as `run_ticks` does.

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
    """Due time of tick 0 in ns (`Lateness.start`), after running `tick` every `period` ns.

    The loop ends when `tick` returns False or `most` ticks were due. A late tick runs at once, with
    its own number. A tick that is a whole period late is skipped, so that the value sent is always
    the one that is due now. Where `wait` returns True, the next tick is due at once and later ticks
    one period apart from it. `refused` returns whether the bus refused the frame of the last tick.
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

"""Clocks of the bench: a monotonic clock for hardware, a simulated clock for simulated trials."""

import time
from collections.abc import Callable
from typing import Protocol

SECOND = 1_000_000_000  # ns
MILLISECOND = 1_000_000  # ns
# ns: the last part of a wait is a busy loop, because a sleep ends late by the wake-up latency
SPIN = 200_000


class Clock(Protocol):
    """A clock that never goes back, in ns."""

    def now_ns(self) -> int:
        """Time of the clock, ns."""

    def sleep_until_ns(self, deadline: int) -> None:
        """Return at `deadline` (ns), or at once where it is past."""


class MonotonicClock:
    """Monotonic clock of the machine, in ns since 1970.

    The wall clock is read once, so that recordings have a date. A wall clock that is set during a
    trial has no effect.
    """

    def __init__(self, spin: int = SPIN) -> None:
        """Wait in a busy loop for the last `spin` ns of every wait."""
        self._origin = time.time_ns() - time.monotonic_ns()
        self._spin = spin

    def now_ns(self) -> int:
        """Time of the clock, ns."""
        return time.monotonic_ns() + self._origin

    def set_by_ns(self) -> int:
        """Change of the wall clock against this clock since this one was made, ns."""
        return time.time_ns() - time.monotonic_ns() - self._origin

    def sleep_until_ns(self, deadline: int) -> None:
        """Sleep until just before `deadline` (ns), then wait in a busy loop."""
        target = deadline - self._origin
        remaining = target - time.monotonic_ns()
        if remaining > self._spin:
            time.sleep((remaining - self._spin) * 1e-9)
        while time.monotonic_ns() < target:
            pass


class SimulatedClock:
    """Clock that advances only during a wait.

    `world` simulates everything else (virtual motorcycle, bus, recorder): it is called with the time
    (ns) up to which it must advance.
    """

    def __init__(self, start_ns: int = SECOND, world: Callable[[int], None] | None = None) -> None:
        self._now = start_ns
        self._world = world

    def now_ns(self) -> int:
        """Time of the clock, ns."""
        return self._now

    def sleep_until_ns(self, deadline: int) -> None:
        """Advance the world, then the clock, to `deadline` (ns)."""
        if deadline <= self._now:
            return
        if self._world is not None:
            self._world(deadline)
        self._now = deadline

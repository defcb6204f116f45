"""Time is passed in: a monotonic clock for hardware, a simulated one for lock step."""

import time
from collections.abc import Callable
from typing import Protocol

SECOND = 1_000_000_000  # ns
MILLISECOND = 1_000_000  # ns


SPIN = 200_000  # ns: sleeping overshoots by the kernel's wake-up latency, so the last bit spins


class Clock(Protocol):
    """Something that can be read and waited for; ns, never going back."""

    def now_ns(self) -> int:
        """Read the clock."""

    def sleep_until_ns(self, deadline: int) -> None:
        """Return at `deadline`, or at once where it is past."""


class MonotonicClock:
    """The machine's steady clock, in ns since the epoch at which it was made.

    Wall time is read once, so that recordings carry a date, and never again: a clock that is set
    while the rider is on the straight moves nothing.
    """

    def __init__(self, spin: int = SPIN) -> None:
        """Spin for the last `spin` ns of every wait."""
        self._origin = time.time_ns() - time.monotonic_ns()
        self._spin = spin

    def now_ns(self) -> int:
        """Read the clock."""
        return time.monotonic_ns() + self._origin

    def set_by_ns(self) -> int:
        """Tell by how much the wall clock was set, or slewed, since this one was made."""
        return time.time_ns() - time.monotonic_ns() - self._origin

    def sleep_until_ns(self, deadline: int) -> None:
        """Sleep to just before `deadline`, then spin."""
        target = deadline - self._origin
        remaining = target - time.monotonic_ns()
        if remaining > self._spin:
            time.sleep((remaining - self._spin) * 1e-9)
        while time.monotonic_ns() < target:
            pass


class SimulatedClock:
    """A clock that moves only when somebody waits for it; the world is advanced meanwhile.

    Whoever must live through the simulated time (the virtual motorcycle, the bus, the recorder)
    is given as `world`: a function called with the time up to which it is to run.
    """

    def __init__(self, start_ns: int = SECOND, world: Callable[[int], None] | None = None) -> None:
        self._now = start_ns
        self._world = world

    def now_ns(self) -> int:
        """Read the clock."""
        return self._now

    def sleep_until_ns(self, deadline: int) -> None:
        """Let the world run to `deadline`."""
        if deadline <= self._now:
            return
        if self._world is not None:
            self._world(deadline)
        self._now = deadline

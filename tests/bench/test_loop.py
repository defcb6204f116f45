"""Every tick is accounted for, whatever the clock does."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bench.clock import MILLISECOND, SimulatedClock
from bench.loop import run_periodic


class SlowTicks:
    """A simulated clock on which each tick takes a given time."""

    def __init__(self, durations):
        self.clock = SimulatedClock()
        self.durations = iter(durations)

    def now_ns(self):
        return self.clock.now_ns()

    def sleep_until_ns(self, deadline):
        self.clock.sleep_until_ns(deadline)

    def work(self):
        self.clock.sleep_until_ns(self.clock.now_ns() + next(self.durations, 0))


@given(st.lists(st.integers(0, 7 * MILLISECOND), max_size=60))
def test_every_tick_is_on_time_late_or_skipped_and_all_are_counted(durations):
    slow, told = SlowTicks(durations), []

    def tick(number, due):
        told.append((number, due, slow.now_ns()))
        slow.work()
        return True

    lateness = run_periodic(tick, MILLISECOND, slow, most=200)
    numbers = [number for number, _, _ in told]
    assert numbers == sorted(set(numbers))
    assert list(lateness.tick) == numbers
    assert lateness.due == lateness.skipped + len(numbers)
    for (number, due, began), late in zip(told, lateness.lateness, strict=True):
        assert due == lateness.start + number * MILLISECOND
        assert began - due == late
        assert 0 <= late < MILLISECOND


def test_on_the_simulated_clock_nothing_is_ever_late():
    clock, times = SimulatedClock(), []
    lateness = run_periodic(
        lambda number, due: times.append(clock.now_ns() - due) or number < 99, MILLISECOND, clock
    )
    assert times == [0] * 100
    assert lateness.skipped == 0
    assert np.all(lateness.lateness == 0)


def test_the_world_lives_through_all_of_the_simulated_time():
    lived = []
    clock = SimulatedClock(0, lived.append)
    run_periodic(lambda number, _due: number < 9, MILLISECOND, clock)
    assert lived == [MILLISECOND * (1 + k) for k in range(10)]

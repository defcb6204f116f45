"""Frame times in the record: steady, whatever is done to the machine's clock."""

from hypothesis import given
from hypothesis import strategies as st

from slipbench.bench.gateway.stamps import SteadyStamps, as_stamped
from slipbench.bench.loop.clock import SECOND, MonotonicClock

START = 1_790_000_000 * SECOND
HOUR = 3600 * SECOND
# ns: half a step of a float of seconds since 1970 (120) and of such a float of nanoseconds (128)
FLOAT = 248


class Watched(MonotonicClock):
    """A clock that a test moves: the time, and by how much the wall clock was set meanwhile."""

    def __init__(self) -> None:
        self.now, self.set_by = START, 0

    def now_ns(self) -> int:
        return self.now

    def set_by_ns(self) -> int:
        return self.set_by


def test_a_clock_that_nobody_sets_leaves_stamps_as_they_are() -> None:
    clock = Watched()
    clock.now = START + SECOND
    stamp = SteadyStamps(clock)
    for after in range(0, SECOND, SECOND // 7):
        assert abs(stamp((START + after) / SECOND) - START - after) <= FLOAT
    assert as_stamped(1.5) == 1_500_000_000


def test_a_step_of_the_wall_clock_is_taken_off() -> None:
    clock = Watched()
    stamp = SteadyStamps(clock)
    for after, set_by in ((1, HOUR), (2, -HOUR), (3, 0)):
        clock.now, clock.set_by = START + after * SECOND, set_by
        assert abs(stamp((clock.now + set_by) / SECOND) - clock.now) <= FLOAT


def test_a_stamp_of_zero_is_zero() -> None:
    assert SteadyStamps(Watched())(0.0) == 0


waits = st.lists(
    st.tuples(st.integers(0, 10**7), st.integers(0, 10**6), st.integers(-HOUR, HOUR)), max_size=40
)


@given(waits)
def test_times_never_go_back_nor_into_the_future_and_are_off_by_no_more_than_the_wait(waits):
    """Each: ns until the next frame, how long it waits to be read, what is set meanwhile."""
    clock = Watched()
    stamp, last = SteadyStamps(clock), 0
    for gap, waited, set_by in waits:
        clock.now += gap
        stamped, arrived = clock.now + clock.set_by, clock.now
        clock.now, clock.set_by = clock.now + waited, clock.set_by + set_by
        told = stamp(stamped / SECOND)
        assert last <= told <= clock.now
        if set_by == 0:
            assert abs(told - arrived) <= FLOAT or told == last
        last = told


def test_the_wall_clock_of_this_machine_was_hardly_set_just_now() -> None:
    assert abs(MonotonicClock().set_by_ns()) < SECOND

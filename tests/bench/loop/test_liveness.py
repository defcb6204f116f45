"""Laws of the detection of a stopped loop."""

from hypothesis import given
from hypothesis import strategies as st

from slipbench.bench.loop.liveness import Liveness
from slipbench.bench.loop.ring import TICK, Ring


@given(st.lists(st.booleans(), max_size=60), st.integers(0, 8))
def test_a_loop_counts_as_stopped_after_that_many_checks_without_a_tick_and_not_before(
    ticks: list[bool], patience: int
) -> None:
    ring = Ring.local(1 << 8)
    pulse, idle = Liveness(ring, patience), 0
    for ticked in ticks:
        if ticked:
            assert ring.append(0, 0, TICK, b"")
        idle = 0 if ticked else idle + 1
        assert pulse.stopped() == (idle > patience)


def test_a_tick_counts_even_where_the_recorder_has_read_it_meanwhile() -> None:
    ring = Ring.local(4)
    pulse = Liveness(ring, 0)
    for _ in range(10):
        assert ring.append(0, 0, TICK, b"")
        list(ring.drain())
        assert not pulse.stopped()

"""Work in threads: the order of the results, failures, and work inside of work."""

from threading import get_ident

import pytest

from slipbench.identification.mismatch.reporting.verdict import as_tree
from slipbench.identification.mismatch.simulation import threads
from slipbench.identification.mismatch.simulation.once import once
from slipbench.identification.mismatch.simulation.threads import in_threads, one_thread
from tests.identification.mismatch.laws.explained import explained
from tests.identification.mismatch.laws.spring import cubic, spring, swung


@pytest.fixture
def workers(monkeypatch: pytest.MonkeyPatch):
    def use(count: int) -> None:
        monkeypatch.setattr(threads, "WORKERS", count)
        threads._pool.cache_clear()

    yield use
    threads._pool.cache_clear()


@pytest.mark.parametrize("count", [1, 2, 4])
def test_results_come_in_the_order_of_the_parts(workers, count):
    workers(count)
    assert in_threads(lambda x: x * x, range(50)) == [x * x for x in range(50)]


def test_a_block_of_one_thread_works_in_its_own_and_others_do_not(workers):
    workers(4)
    with one_thread():
        assert set(in_threads(lambda _: get_ident(), range(8))) == {get_ident()}
    assert get_ident() not in in_threads(lambda _: get_ident(), range(8))


@pytest.mark.parametrize("count", [1, 2])
def test_work_inside_of_work_does_not_wait_for_ever(workers, count):
    workers(count)
    table = in_threads(lambda a: in_threads(lambda b: a * b, range(5)), range(5))
    assert table == [[a * b for b in range(5)] for a in range(5)]


def test_the_first_failure_in_the_order_of_the_parts_is_raised(workers):
    workers(4)

    def work(x: int) -> int:
        if x > 2:
            raise ValueError(x)
        return x

    with pytest.raises(ValueError, match=r"^3$"):
        in_threads(work, range(8))


def test_once_works_a_property_out_once_for_an_object():
    executed = []

    class Thing:
        @once
        def worth(self) -> int:
            """A number."""
            executed.append(self)
            return 7

    one, other = Thing(), Thing()
    assert (one.worth, one.worth, other.worth) == (7, 7, 7)
    assert executed == [one, other]
    assert Thing.worth.__doc__ == "A number."


def test_the_verdict_does_not_depend_on_the_number_of_threads(tmp_path, workers):
    system = spring(tmp_path)
    rides = [swung(seed, cubic(0.5), 10.0) for seed in (1, 2, 3)]
    found = []
    for count in (1, 2, 4):
        workers(count)
        found.append(as_tree(explained(system, rides[:2], rides[2:])))
    assert found[0]["effects"]
    assert found[0] == found[1] == found[2]

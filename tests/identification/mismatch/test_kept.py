"""Results of an analysis do not stay in memory after it."""

import gc
import weakref

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.simulation.kept import forget_results, last_results
from tests.identification.mismatch.laws.spring import cubic, spring, swung


def test_nothing_of_an_analysis_stays_after_it(tmp_path):
    """Regression: a process that analysed 25 blind cases held 6 GB."""
    system = spring(tmp_path)
    a = begin(
        system, [system.prepare(swung(1, cubic(0.3)))], [system.prepare(swung(2, cubic(0.3)))]
    )
    kinds = [k for k in system.library if k.name in ("cubic", "lag", "friction")]
    analyse(a, kinds)
    assert a.named.names
    fits = [weakref.ref(each) for each in (a.base, a.named.fit, a.held_out, a.training)]
    del a
    gc.collect()
    assert [ref() for ref in fits] == [None] * len(fits)


def test_the_last_results_are_kept_until_they_are_forgotten():
    calls = []

    @last_results(2)
    def twice(number):
        calls.append(number)
        return 2 * number

    assert [twice(n) for n in (1, 2, 1, 2)] == [2, 4, 2, 4]
    assert calls == [1, 2]
    twice(3)
    twice(1)
    assert calls == [1, 2, 3, 1]
    forget_results()
    twice(1)
    assert calls == [1, 2, 3, 1, 1]

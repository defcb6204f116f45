"""A motorcycle's verdict is checked by simulated rides, through its sensors and its own noise."""

from dataclasses import replace

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.predictive_check.check import check
from slipbench.identification.mismatch.predictive_check.order import Order
from slipbench.identification.mismatch.reporting.check_result import Rate
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.plant.effects.library import LIBRARY
from tests.identification.mismatch.conditions import erring, system
from tests.identification.mismatch.laws.motorcycle import LEARN, PROVE
from tests.identification.motorcycle_recording import ride

BACKLASH = next(kind for kind in LIBRARY if kind.name == "backlash")


def test_backlash_of_a_motorcycle_is_named_again_and_nothing_without_it():
    bike = replace(erring(5, 0.6), effects=(BACKLASH(),))
    known = system()
    sets = ([known.prepare(ride(bike, r)) for r in rides] for rides in (LEARN, PROVE))
    a = analyse(begin(known, *sets), [BACKLASH])
    found = check(a, verdict(a), Order(1, library=[BACKLASH]))
    assert found.failures == ()
    assert found.same == found.place == Rate(1, 1)
    assert found.inside == Rate(2, 2)
    assert found.false_alarms == Rate(0, 1)

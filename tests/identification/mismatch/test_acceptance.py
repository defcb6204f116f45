"""The level of a search: the family-wise error over all screenings stays below it."""

from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.naming.acceptance import Acceptance
from slipbench.identification.mismatch.thresholds import FALSE_ALARM_RATE, LIBRARY_SHARE


@given(tests=st.integers(1, 10_000), screenings=st.integers(1, 500))
def test_all_tests_of_all_screenings_together_stay_below_the_level(tests, screenings):
    limits = [Acceptance(tests, None, n).significance_rule.limit for n in range(1, screenings + 1)]
    assert tests * sum(limits) < FALSE_ALARM_RATE * LIBRARY_SHARE
    assert tests * sum(limits) == pytest.approx(
        FALSE_ALARM_RATE * LIBRARY_SHARE * (1.0 - 1.0 / (screenings + 1))
    )


@given(tests=st.integers(1, 10_000), screenings=st.integers(1, 500))
def test_a_later_screening_must_be_more_certain(tests, screenings):
    now, later = (
        Acceptance(tests, None, n).significance_rule.limit for n in (screenings, screenings + 1)
    )
    assert later < now


@given(found=st.dictionaries(st.sampled_from("abc"), st.integers(1, 20)), last=st.integers(20, 40))
def test_each_effect_is_held_to_the_level_at_which_it_was_found(found, last):
    fit = SimpleNamespace(candidates=[SimpleNamespace(name=name) for name in "abc"])
    rule = Acceptance(7, None, last, found)
    for i, name in enumerate("abc"):
        limit_of_level = Acceptance(7, None, found.get(name, last)).significance_rule.limit
        assert rule._rule_of_effect(fit, i).limit == limit_of_level

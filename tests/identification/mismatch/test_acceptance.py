"""The level of a search: the family-wise error over all screenings stays below it."""

from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.naming import significance as rule
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


@pytest.mark.parametrize("doubtful", [0, 1])
def test_no_fit_is_run_where_an_effect_is_insignificant_by_its_size(monkeypatch, doubtful):
    """The other effect would need a fit of the held-out recordings, which takes seconds."""
    sizes = [1e-3, 1e-3]
    sizes[doubtful] = 1.0
    fitted = []
    monkeypatch.setattr(rule, "significance", lambda _, i: sizes[i])
    monkeypatch.setattr(rule, "p_of_loss", lambda *_: fitted.append("training") or 1e-3)
    monkeypatch.setattr(rule, "predicted_held_out", lambda *_: fitted.append("held out") or 1.0)
    fit = SimpleNamespace(candidates=[SimpleNamespace(name=name) for name in "ab"])
    acceptance = Acceptance(1000, SimpleNamespace())
    assert not acceptance.all_significant(fit)
    assert fitted == []
    sizes[doubtful] = 1e-3
    assert not acceptance.all_significant(fit)
    assert fitted == ["training", "held out"]

"""When a name is significant: by training recordings alone, or jointly with held-out ones."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy import stats

from slipbench.identification.mismatch.naming import significance as rule
from slipbench.identification.mismatch.naming.significance import CHOICES, SignificanceRule, joined
from slipbench.identification.mismatch.thresholds import JOINT_TEST_P

LIMIT = 1e-5
P = st.floats(1e-200, 1.0)


@given(one=P, other=P)
def test_two_that_are_joined_tell_what_fishers_method_says_in_either_order(one, other):
    assume(other < 1.0 and one < 1.0)
    expected = stats.chi2.sf(-2.0 * (np.log(one) + np.log(other)), 4)
    assert joined(one, other) == pytest.approx(expected, rel=1e-6)
    assert joined(one, other) == pytest.approx(joined(other, one), rel=1e-12)


@given(one=P)
def test_recordings_that_tell_nothing_change_nothing(one):
    assert joined(one, 1.0) == one


def test_what_is_joined_of_chance_is_as_rare_as_it_says():
    rng = np.random.default_rng(11)
    print("seed 11")
    drawn = [joined(*p) for p in rng.uniform(size=(20_000, 2))]
    assert stats.kstest(drawn, "uniform").pvalue > 1e-3


@pytest.fixture(autouse=True)
def no_loss(monkeypatch):
    """The size alone counts."""
    monkeypatch.setattr(rule, "p_of_loss", lambda *_: 1.0)


@pytest.fixture
def told(monkeypatch):
    """Set the p-values of training and held-out recordings; return p of the rule."""

    def tell(training: float, held_out: float) -> float:
        monkeypatch.setattr(rule, "significance", lambda *_: training)
        monkeypatch.setattr(rule, "predicted_held_out", lambda *_: held_out)
        return SignificanceRule(LIMIT, SimpleNamespace()).p(None, 0)

    return tell


@given(training=P, held_out=P)
def test_held_out_recordings_never_make_doubted_ones_certain(training, held_out):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rule, "significance", lambda *_: training)
        patch.setattr(rule, "predicted_held_out", lambda *_: held_out)
        p = SignificanceRule(LIMIT, SimpleNamespace()).p(None, 0)
    assert p <= min(1.0, CHOICES * training)
    if training > JOINT_TEST_P or (training >= 0.5 * LIMIT and held_out == 1.0):
        assert p == min(1.0, CHOICES * training)


def test_a_choice_of_two_ways_costs_a_factor_of_two(told):
    assert told(1e-9, 1.0) == pytest.approx(CHOICES * 1e-9)
    assert told(1e-3, 1e-9) == pytest.approx(CHOICES * joined(1e-3, 1e-9))
    assert told(1e-3, 0.5) == pytest.approx(CHOICES * 1e-3)


def test_without_held_out_recordings_those_of_training_tell_alone(monkeypatch):
    monkeypatch.setattr(rule, "significance", lambda *_: 1e-3)
    assert SignificanceRule(LIMIT).p(None, 0) == 1e-3


@pytest.mark.parametrize(
    ("by_size", "by_loss", "expected"),
    [(1e-3, 1e-30, 1e-30), (1e-3, 0.5, 1e-3), (0.5, 1e-30, 0.5), (1e-9, 1e-30, 1e-9)],
)
def test_a_doubtful_size_counts_by_what_is_lost_without_it(monkeypatch, by_size, by_loss, expected):
    monkeypatch.setattr(rule, "significance", lambda *_: by_size)
    monkeypatch.setattr(rule, "p_of_loss", lambda *_: by_loss)
    assert SignificanceRule(LIMIT).p(None, 0) == expected

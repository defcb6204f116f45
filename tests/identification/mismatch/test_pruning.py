"""What stays of the names when those that are not missed have gone."""

from dataclasses import dataclass
from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.naming import pruning


class Told:
    """Certain is what a stand says of itself."""

    def holds(self, fit, i):
        return fit.certain[fit.names][i]

    def all_hold(self, fit):
        return all(self.holds(fit, i) for i in range(len(fit.names)))


@dataclass(frozen=True)
class Kind:
    name: str


@dataclass(frozen=True)
class Stand:
    """A fit of some of the effects. worth: nats; certain: of every set the names that are."""

    names: tuple[str, ...]
    worth: dict
    certain: dict

    @property
    def candidates(self):
        return tuple(map(Kind, self.names))

    @property
    def score(self):
        return self.worth[self.names]

    def without(self, i):
        return Stand((*self.names[:i], *self.names[i + 1 :]), self.worth, self.certain)


SETS = [c for count in range(4) for c in combinations("abc", count)]
WORTHS = st.lists(st.floats(0.0, 300.0), min_size=3, max_size=3).map(sorted)
CERTAINTIES = st.fixed_dictionaries({s: st.tuples(*(st.booleans() for _ in s)) for s in SETS if s})


@pytest.fixture(autouse=True)
def _stands(monkeypatch):
    monkeypatch.setattr(
        pruning,
        "_lost",
        lambda f: [(f.score - f.without(i).score, f.without(i)) for i in range(len(f.names))],
    )
    monkeypatch.setattr(pruning, "alike", lambda *_: False)


def pruned(worth, certain):
    base = Stand((), worth, certain)
    return pruning.pruned(base, Stand(("a", "b", "c"), worth, certain), Told(), lambda _: None)


@given(steps=WORTHS, certain=CERTAINTIES)
def test_what_stays_is_certain_and_missed(steps, certain):
    worth = {s: 0.0 if not s else steps[len(s) - 1] for s in SETS}
    left = pruned(worth, certain)
    if left.names:
        assert all(certain[left.names])
        lost = [left.score - left.without(i).score for i in range(len(left.names))]
        assert min(lost) >= pruning.ENOUGH


def test_what_would_take_the_certainty_of_the_others_does_not_go_first():
    worth = {s: 280.0 if s else 0.0 for s in SETS}
    certain = {s: (True,) * len(s) for s in SETS if s}
    certain[("b",)] = (False,)
    assert pruned(worth, certain).names == ("a",) or pruned(worth, certain).names == ("c",)


def test_what_all_miss_stays():
    worth = {s: 100.0 * len(s) for s in SETS}
    assert pruned(worth, {s: (True,) * len(s) for s in SETS if s}).names == ("a", "b", "c")

"""The search: swap step for a name in a local optimum, and backward elimination."""

from dataclasses import dataclass, replace
from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.analysis import begin, equivalents
from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.fit.held_out import Veto
from slipbench.identification.mismatch.fit.least_squares_start import least_squares_start
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.naming import acceptance, search
from slipbench.identification.mismatch.naming.acceptance import Acceptance
from slipbench.identification.mismatch.naming.candidates import candidates
from slipbench.identification.mismatch.naming.named import Named
from slipbench.identification.mismatch.naming.score import Screening, screen
from slipbench.identification.mismatch.naming.search import Search
from slipbench.identification.mismatch.thresholds import REQUIRED_GAIN
from tests.identification.mismatch.spring import recorded, system

BENT = ("asymmetry", "cubic", "dead_zone")


@pytest.fixture(scope="module")
def bare(tmp_path_factory) -> Fit:
    """The linear spring, re-calibrated on a hardening one."""
    spring = system(tmp_path_factory.mktemp("spring"))
    analysis = begin(spring, [spring.prepare(recorded(33, cube=0.05, seconds=12.0))], [])
    return calibrate(analysis.training, analysis.training.origin())


def after_exchange(bare: Fit, key: str) -> tuple[Named, Named]:
    library = [
        k for k in bare.model.system.library if k.name in BENT and k.place.name == "deflection"
    ]
    kind = next(k for k in library if k().key == key)
    fit = least_squares_start(with_effects(bare, (next(candidates(kind)),)))
    first = screen(Linearization.of(bare), library)
    named = Named(bare, fit, first, competing={key: {"dead_zone.deflection": 3.0}})
    return named, Search(library).exchanged(named)


def test_a_wrong_name_is_exchanged_for_the_right_one_and_becomes_its_rival(bare) -> None:
    before, after = after_exchange(bare, "asymmetry.deflection")
    assert after.names == ["cubic.deflection"]
    nats = after.log_likelihood_gain - before.log_likelihood_gain
    assert after.competing == {"cubic.deflection": {"asymmetry.deflection": pytest.approx(nats)}}


def test_a_right_name_stays(bare) -> None:
    before, after = after_exchange(bare, "cubic.deflection")
    assert after.fit is before.fit
    assert after.screenings == before.screenings + 1, "it was screened for in vain"


def test_screenings_in_vain_and_vetoes_of_an_exchange_count(monkeypatch) -> None:
    """Every screening lowers the level of significance, with or without a resulting name."""
    stand = Stand(("a", "b"), {("a", "b"): 0.0}, {})
    veto = Veto("c", -9.0, 5.0)
    exchanged = replace(Named(stand, stand, Screening([], 1)), screenings=3, vetoes=(veto,))
    monkeypatch.setattr(Search, "exchanged", lambda *_: exchanged)
    monkeypatch.setattr(search, "pruned", lambda named, rule, _: (named, rule))
    named, rule = Search(())._refined(Named(stand, stand, Screening([], 1)))
    assert named.vetoes == (veto,)
    assert rule.screenings == 3


def test_an_effect_keeps_the_level_of_the_screening_that_found_it() -> None:
    worth = {(): 0.0, ("a",): 40.0, ("b",): 30.0, ("a", "b"): 70.0}
    base, one, both = (Stand(names, worth, {}) for names in ((), ("a",), ("a", "b")))
    begun = Named(base, base, Screening([], 1))
    named = Search(())._with(begun, one, one, [])
    named = Search(())._with(replace(named, screenings=5), both, both, [])
    assert named.found_in == {"a": 1, "b": 5}
    other = Stand(("a", "c"), {("a", "c"): 90.0}, {})
    exchanged = Search(())._renamed(replace(named, screenings=9), other)
    assert exchanged.found_in == {"a": 1, "c": 9}


# Backward elimination, on sets with known scores and significance.


class StatedSignificance(Acceptance):
    """Acceptance that returns the significance stated in a stand."""

    def is_significant(self, fit, i):
        return fit.certain[fit.names][i]

    def all_significant(self, fit):
        return all(self.is_significant(fit, i) for i in range(len(fit.names)))

    def ps(self, fit):
        return [0.0 for _ in fit.names]


@dataclass(frozen=True)
class Kind:
    name: str


@dataclass(frozen=True, eq=False)
class Stand:
    """A fit of some of the effects. worth: nats; certain: significance by set."""

    names: tuple[str, ...]
    worth: dict
    certain: dict

    @property
    def candidates(self):
        return tuple(map(Kind, self.names))

    @property
    def coarse(self):
        return self

    effects = ()

    @property
    def score(self):
        return self.worth[self.names]

    def without(self, i):
        return Stand((*self.names[:i], *self.names[i + 1 :]), self.worth, self.certain)


class StatedVeto(Acceptance):
    """Acceptance in which held-out recordings contradict the stated effects."""

    def __init__(self, contradicts: str) -> None:
        super().__init__(1, None)
        vars(self).update(contradicts=contradicts, asked=[])

    def accepts(self, before, after):
        return after.score - before.score >= REQUIRED_GAIN

    def ps(self, fit):
        return [1e-9]

    def veto(self, before, after):
        name = after.names[-1]
        self.asked.append(name)
        return Veto(name, -9.0, 5.0) if name in self.contradicts else None


def step(monkeypatch, contradicts, fits, rejected):
    """Return the names after a step, and the effects that were tested on held-out recordings."""
    rule = StatedVeto(contradicts)
    monkeypatch.setattr(Search, "_rule", lambda *_: rule)
    monkeypatch.setattr(search, "_finer", lambda named, new, same: new)
    monkeypatch.setattr(search, "plausible_first", lambda fits, shared, margin: fits)
    base = Stand((), {(): 0.0}, {})
    found = Search(())._step(Named(base, base, Screening([], 1)), fits, rejected)
    return found.names, rule.asked


def one(name: str, gain: float) -> Stand:
    return Stand((name,), {(name,): gain}, {})


def test_a_contradicted_effect_is_tested_once_per_round(monkeypatch) -> None:
    rejected: list[Stand] = []
    first, second = one("a", 50.0), one("b", 40.0)
    assert step(monkeypatch, "ab", [first, second], rejected) == ([], ["a", "b"])
    again = [one("a", 52.0), first, second, one("c", 30.0)]
    assert step(monkeypatch, "ab", again, rejected) == (["c"], ["c"])


def test_a_clearly_better_fit_of_it_is_tested_again(monkeypatch) -> None:
    rejected = [one("a", 50.0)]
    assert step(monkeypatch, "", [one("a", 80.0)], rejected) == (["a"], ["a"])


def test_at_most_three_are_tested_per_round(monkeypatch) -> None:
    rejected: list[Stand] = []
    five = [one(name, 90.0 - i) for i, name in enumerate("abcde")]
    assert step(monkeypatch, "abcde", five, rejected) == ([], ["a", "b", "c"])
    assert step(monkeypatch, "", five, rejected) == ([], [])


def test_competing_effects_are_listed_the_closest_first_each_at_its_best() -> None:
    worth = {("a",): 40.0, ("b",): 39.0, ("c",): 30.0}
    best, second, third = (Stand(names, worth, {}) for names in worth)
    worse = Stand(("b",), {("b",): 20.0}, {})
    deficits = search._deficits(best, [best, second, third, worse])
    assert list(deficits.items()) == [("b", 1.0), ("c", 10.0)]


def test_effects_that_are_all_accepted_do_not_compete() -> None:
    """Two faults of a similar gain competed in the first step, and both were found."""
    both = Stand(("a", "b"), {}, {})
    competing = {"a": {"b": -6.0, "c": 3.0}, "b": {"c": 40.0}}
    named = Named(both, both, Screening([], 1), competing=competing)
    assert named.rivals == {"a": {"c": 3.0}, "b": {"c": 40.0}}
    assert equivalents(named) == [("a", "c")]


SETS = [c for count in range(4) for c in combinations("abc", count)]
WORTHS = st.lists(st.floats(0.0, 300.0), min_size=3, max_size=3).map(sorted)
CERTAINTIES = st.fixed_dictionaries({s: st.tuples(*(st.booleans() for _ in s)) for s in SETS if s})


@pytest.fixture(autouse=True)
def _stands(monkeypatch):
    def lost_without(_, f):
        return [(f.score - f.without(i).score, f.without(i)) for i in range(len(f.names))]

    monkeypatch.setattr(search, "lost_without", lost_without)
    monkeypatch.setattr(acceptance, "same_injection_point", lambda *_: False)


def pruned(worth, certain):
    base = Stand((), worth, certain)
    named = Named(base, Stand(("a", "b", "c"), worth, certain), Screening([], 1))
    return search.pruned(named, StatedSignificance(1, None), lambda _: None).fit


@given(steps=WORTHS, certain=CERTAINTIES)
def test_what_stays_is_certain_and_missed(steps, certain):
    worth = {s: 0.0 if not s else steps[len(s) - 1] for s in SETS}
    remaining = pruned(worth, certain)
    if remaining.names:
        assert all(certain[remaining.names])
        lost = [remaining.score - remaining.without(i).score for i in range(len(remaining.names))]
        assert min(lost) >= REQUIRED_GAIN


def test_what_would_take_the_certainty_of_the_others_does_not_go_first():
    worth = {s: 280.0 if s else 0.0 for s in SETS}
    certain = {s: (True,) * len(s) for s in SETS if s}
    certain[("b",)] = (False,)
    assert pruned(worth, certain).names == ("a",) or pruned(worth, certain).names == ("c",)


def test_what_all_miss_stays():
    worth = {s: 100.0 * len(s) for s in SETS}
    assert pruned(worth, {s: (True,) * len(s) for s in SETS if s}).names == ("a", "b", "c")


def test_what_stays_after_worse_predictions_is_certain(monkeypatch):
    """The remaining name was significant beside the other name only."""
    worth = {(): 0.0, ("a",): 40.0, ("b",): 40.0, ("a", "b"): 90.0}
    certain = {("a",): (False,), ("a", "b"): (True, True)}
    base, both = Stand((), worth, certain), Stand(("a", "b"), worth, certain)

    def mispredicted(model, base, fit, most):
        return Veto("a + b", -50.0, -most) if len(fit.names) > 1 else None

    monkeypatch.setattr(search, "mispredicted", mispredicted)
    monkeypatch.setattr(search, "fitted_without", lambda fit, i: fit.without(i))
    monkeypatch.setattr(Search, "_rule", lambda *_: StatedSignificance(1, None))
    found = Search((), held_out=object()).predicting(Named(base, both, Screening([], 1)))
    assert found.names == []
    assert [v.name for v in found.vetoes] == ["a + b"]
    silent = Search(()).predicting(Named(base, both, Screening([], 1)))
    assert silent.names == ["a", "b"], "nothing was held out"

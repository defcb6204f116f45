"""Effect responses at one fit identify the promising effects at another fit."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.naming import fits
from slipbench.identification.mismatch.naming.candidates import candidates
from slipbench.identification.mismatch.naming.fits import (
    fitted,
    near_ones_refined,
    others_refined,
    roughly,
)
from slipbench.identification.mismatch.naming.score import Screening, screen
from slipbench.identification.mismatch.naming.traces import OF_EACH, Traces
from slipbench.identification.mismatch.simulation.model import predict
from slipbench.plant.effects.air_box_delay import AirBoxDelay
from tests.identification.mismatch.spring import recorded, system

PLAIN = next(candidates(AirBoxDelay))


@pytest.fixture(scope="module")
def bare(tmp_path_factory) -> Fit:
    """The linear spring, re-calibrated on a hardening one."""
    spring = system(tmp_path_factory.mktemp("spring"))
    analysis = begin(spring, [spring.prepare(recorded(33, cube=0.05, seconds=12.0))], [])
    return calibrate(analysis.training, analysis.training.origin())


@pytest.fixture(scope="module")
def first(bare) -> Screening:
    return screen(Linearization.of(bare), bare.model.system.library)


def some(library, count: int) -> list[Candidate]:
    return [next(candidates(kind)) for kind in library][:count]


def test_the_most_promising_beside_another_fit_is_that_of_a_whole_survey(bare, first) -> None:
    library = bare.model.system.library
    for score in first.scores[:3]:
        fit = fitted(bare, score.as_large_as_scored())
        assert fit is not None
        complete = screen(Linearization.of(fit), library)
        quick = screen(Linearization.of(fit), library, first)
        assert quick.scores[0].candidate.name == complete.scores[0].candidate.name
        assert quick.scores[0].log_likelihood_gain == pytest.approx(
            complete.scores[0].log_likelihood_gain, rel=1e-9
        )
        assert quick.tests >= first.tests


def test_fewer_are_screened_where_what_effects_changed_still_holds(bare, first) -> None:
    near = replace(bare.point, x=bare.point.x + 0.05)
    fit = replace(bare, point=near, predicted=predict(bare.model, near))
    library = bare.model.system.library
    complete, quick = (screen(Linearization.of(fit), library, before) for before in (None, first))
    assert len(quick.scores) < len(complete.scores)
    assert quick.scores[0].candidate.name == complete.scores[0].candidate.name


def test_what_left_no_trace_is_screened_anew(bare, first) -> None:
    """Without stored traces each effect is screened."""
    library = bare.model.system.library
    blank = Screening(first.scores, first.tests)
    again = screen(Linearization.of(bare), library, blank)
    assert [s.candidate.name for s in again.scores] == [s.candidate.name for s in first.scores]
    assert [s.log_likelihood_gain for s in again.scores] == [
        s.log_likelihood_gain for s in first.scores
    ]


def test_signatures_are_whitened_changes(bare) -> None:
    linear = Linearization.of(bare)
    chosen = some(bare.model.system.library, 6)
    changes = linear.changes(chosen)
    assert np.array_equal(linear.effect_responses(chosen), linear.whitened(changes))
    single = [[[np.float32(one) for one in block] for block in change] for change in changes]
    largest = np.max(np.abs(linear.effect_responses(chosen)))
    assert linear.whitened(single) == pytest.approx(
        linear.effect_responses(chosen), abs=1e-4 * largest
    )


@given(
    credits=st.lists(st.tuples(st.floats(0, 10), st.floats(0, 10)), max_size=40),
    room=st.integers(0, 20),
)
def test_the_best_tries_of_each_effect_are_kept_as_far_as_there_is_room(credits, room) -> None:
    traces = Traces(room)
    given_credits = {}
    for number, credit in enumerate(credits):
        one = replace(PLAIN, parameters=(1.0 + number, *PLAIN.parameters[1:]))
        given_credits[one] = credit
        traces.add(one, credit, [[np.full((1, 1), float(number))]])
    kept = [given_credits[c] for c, _ in traces.candidates()]
    assert len(kept) == min(len(credits), room, OF_EACH)
    assert all(a >= b for a, b in pairwise(kept))
    if room >= OF_EACH:
        assert sorted(kept) == sorted(sorted(credits)[-OF_EACH:])
    assert traces.names() == ({PLAIN.name} if kept else set())
    for c, change in traces.candidates():
        assert change[0][0].item() == c.parameters[0] - 1.0


def test_the_best_of_fits_that_are_refined_is_that_of_whole_fits(bare, first) -> None:
    rough = [roughly(bare, s.as_large_as_scored()) for s in first.scores[:6]]
    done = near_ones_refined(bare, [*rough, None])
    assert all(a.score >= b.score for a, b in zip(done, rough, strict=True) if b is not None)
    complete = [fitted(bare, s.as_large_as_scored()) for s in first.scores[:6]]
    best = max(f.score for f in complete if f is not None)
    assert max(f.score for f in done) == pytest.approx(best, abs=0.5)


@dataclass(frozen=True)
class Place:
    """Stand-in for the variance inflation over the places of an effect."""

    inflation: float


@dataclass(frozen=True)
class Found:
    placebo: Place | None = None


BEFORE, ANEW = object(), object()
HERE, ANYWHERE = (Found(),), (Found(Place(10.0)),)


@dataclass(frozen=True)
class Stand:
    """Stand-in for a fit. hidden: whether a noise model keeps it at its start."""

    score: float
    hidden: bool = False
    candidates: tuple[Found, ...] = HERE
    slopes: object = BEFORE


@pytest.fixture
def stands(monkeypatch):
    monkeypatch.setattr(fits, "hidden_by_noise", lambda fit: fit.hidden)
    monkeypatch.setattr(
        fits, "refined", lambda fit: replace(fit, score=fit.score + 1.0, slopes=ANEW)
    )


@pytest.mark.parametrize("hidden", [False, True])
def test_fits_near_to_the_best_or_held_by_noise_are_refined_and_others_left(stands, hidden) -> None:
    """Those held by noise only where the best fit is held by it as well."""
    held = [Stand(106.1, hidden=True), Stand(105.9, hidden=True)]
    rough = [Stand(130.0, hidden), None, Stand(120.9), Stand(121.1), *held]
    done = near_ones_refined(Stand(100.0, candidates=()), rough)
    assert [f.score for f in done] == [131.0, 120.9, 122.1, 107.1 if hidden else 106.1, 105.9]


def test_what_is_found_as_well_anywhere_leads_only_as_far_as_it_counts(stands) -> None:
    rough = [Stand(170.0, candidates=ANYWHERE), Stand(115.0), Stand(109.0)]
    done = near_ones_refined(Stand(100.0, candidates=()), rough)
    assert [f.score for f in done] == [170.0, 116.0, 109.0]


def test_those_that_were_left_are_refined_where_the_leading_ones_do_not_pass(stands) -> None:
    base = Stand(100.0, candidates=())
    done = near_ones_refined(base, [Stand(130.0), Stand(120.0)])
    assert [f.score for f in others_refined(base, done)] == [121.0]
    assert others_refined(base, near_ones_refined(base, [Stand(130.0)])) == []

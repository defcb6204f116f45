"""Score tests, directions of signatures, and when changes at one fit are valid at another."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.fit.calibrate import calibrate, start_fit
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.naming.candidates import candidates
from slipbench.identification.mismatch.naming.fits import fitted, moved
from slipbench.identification.mismatch.naming.rescreen import promising_again
from slipbench.identification.mismatch.naming.score import at_other_places, screen
from slipbench.identification.mismatch.naming.score_tests import (
    ALIKE,
    different,
    directions,
    score_tests,
)
from slipbench.identification.mismatch.systems.system import ModelSystem
from tests.identification.mismatch.drives import recorded
from tests.paths import MODELS


@pytest.fixture(scope="module")
def drives() -> ModelSystem:
    return ModelSystem.load(MODELS / "coupled_drives.toml")


@pytest.fixture(scope="module")
def far_fit(drives) -> Fit:
    """Two drives with a diverging time constant, since belt and blindness are missing."""
    model = begin(drives, [drives.prepare(recorded(82, seconds=8.0))], []).training
    return calibrate(model, model.origin())


@given(
    seed=st.integers(0, 10_000),
    count=st.integers(0, 8),
    rows=st.integers(1, 4),
    most=st.integers(0, 5),
)
def test_different_signatures_are_unlike_each_other_and_all_others_like_one_before(
    seed, count, rows, most
) -> None:
    columns = np.random.default_rng(seed).standard_normal((rows, count))
    columns /= np.linalg.norm(columns, axis=0)
    found = different(columns, most)
    cosine = np.abs(columns.T @ columns)
    assert len(found) <= most
    assert all(cosine[i, j] < ALIKE for i in found for j in found if i != j)
    if len(found) < most:
        unselected = set(range(count)) - set(found)
        assert all(any(cosine[i, j] >= ALIKE for j in found if j < i) for i in unselected)


def test_directions_have_length_one_and_are_off_the_nuisances(far_fit) -> None:
    linear = Linearization.of(far_fit)
    hidden = linear.nuisances.columns[:, :1]
    changes = linear.effect_responses(
        [c for kind in linear.fit.model.system.library[:8] for c in candidates(kind)]
    )
    found = directions(linear, np.concatenate((changes, 0.0 * hidden), axis=1))
    length = np.linalg.norm(found, axis=0)
    assert length[-1] == 0.0
    assert all(n == 0.0 or n == pytest.approx(1.0) for n in length)


def test_an_amplitude_is_that_of_least_squares(far_fit) -> None:
    """The residual of the least-squares amplitude is orthogonal to the signature."""
    linear = Linearization.of(far_fit)
    column = linear.effect_responses(
        [next(candidates(k)) for k in linear.fit.model.system.library[:4]]
    )
    tests = score_tests(linear, column)
    off = linear.nuisances.project_out(column)
    for i in np.flatnonzero(tests.visible):
        remaining = linear.residuals - tests.amplitude[i] * off[:, i]
        assert off[:, i] @ remaining == pytest.approx(0.0, abs=1e-6 * np.sqrt(tests.energy[i]))


def test_changes_hold_beside_the_same_fit_and_not_where_parameters_were_far_away(far_fit) -> None:
    """A blind counter shows where the speed changes its sign: not with a time constant of 10 s."""
    library = far_fit.model.system.library
    first = screen(Linearization.of(far_fit), library)
    same = promising_again(Linearization.of(far_fit), first.traces)
    assert same is not None
    best = {s.candidate.name for s in first.scores[:3]}
    assert best & first.traces.names() <= same
    there = Linearization.of(start_fit(far_fit.model, far_fit.model.origin()))
    assert promising_again(there, first.traces) is None
    full, again = (screen(there, library, before) for before in (None, first))
    assert [s.candidate.name for s in full.scores] == [s.candidate.name for s in again.scores]


def test_an_effect_keeps_its_values_at_another_place_and_explains_no_less(far_fit) -> None:
    model = far_fit.model
    library = model.system.library
    kind = next(k for k in library if k().key == "elastic_transmission.voltage")
    belt = replace(next(candidates(kind)), parameters=(0.9, 0.3, -0.2))
    others = list(at_other_places(belt, library, model))
    assert [c.name for c in others] == ["elastic_transmission.torque"]
    assert others[0].parameters == belt.parameters
    fit = fitted(
        far_fit, next(candidates(next(k for k in library if k.name == "direction_blind"))), belt
    )
    assert fit is not None
    there = moved(far_fit, fit, 1, others[0])
    assert there is None or there.score > fit.score
    assert there is None or there.candidates[1].name == "elastic_transmission.torque"

"""Validation on held-out data: the truth explains everything, a wrong model does not."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.identification.models.recommended import Recommended, recommended
from slipbench.identification.models.residual_tests import ResidualTests
from slipbench.identification.models.study import study_of
from slipbench.identification.models.validation import (
    Validation,
    predicted_by_bands,
    validated,
    validated_on,
)
from slipbench.identification.response.identify import identify
from slipbench.identification.response.swept_recording import swept_run_of
from slipbench.identification.response.swept_run import SweptRun
from tests.identification.synthetic_recording import Truth, recording


@pytest.fixture(scope="module")
def found():
    return identify(recording(Truth(noise=0.05)))


@pytest.fixture(scope="module")
def model(found):
    model = recommended(found.main)
    assert isinstance(model, Recommended)
    return model


def test_the_model_of_a_quiet_run_explains_its_held_out_bands():
    found = identify(recording(Truth(noise=0.0)))
    checked = study_of(found).validations
    assert checked
    for one in checked:
        assert one.fit > 98.0
        assert "bands" in one.held_out


def test_noise_lowers_the_fit_by_its_share_and_the_residual_stays_free_of_the_input(found, model):
    checked = validated(found, model)
    assert isinstance(checked, Validation)
    assert isinstance(checked.tests, ResidualTests)
    assert checked.tests.cross_correlation.passed
    share = checked.error / np.std(checked.measured)
    assert checked.fit == pytest.approx(100 * (1 - share), abs=0.5)


def test_another_run_is_predicted_as_well_and_a_wrong_model_is_rejected(found, model):
    other = identify(recording(Truth(noise=0.05, seed=5)))
    good = validated_on(model.fit, other)
    assert isinstance(good, Validation)
    assert isinstance(good.tests, ResidualTests)
    assert good.tests.cross_correlation.passed
    stiffer = identify(recording(Truth(noise=0.05, seed=5, frequency=8.8)))
    bad = validated_on(model.fit, stiffer)
    assert isinstance(bad, Validation)
    assert isinstance(bad.tests, ResidualTests)
    assert bad.fit < good.fit - 5
    assert not bad.tests.cross_correlation.passed


def test_no_block_is_predicted_by_a_model_that_was_fitted_to_it(found, model):
    """Lines of one band that are wrong spoil the prediction of other bands, not of their own."""
    lines = model.fit.lines
    count = lines.frequency.size
    third = slice(round(2 * count / 10), round(3 * count / 10))
    value = lines.value.copy()
    value[third] *= 1.5
    spoiled = replace(model, fit=replace(model.fit, lines=replace(lines, value=value)))
    run = swept_run_of(found)
    assert isinstance(run, SweptRun)
    before, after = (predicted_by_bands(run, one.fit) for one in (model, spoiled))
    assert before is not None
    assert after is not None
    moved = np.abs(after - before)
    low, high = lines.frequency[[third.start, third.stop - 1]]
    own = (run.sweep.frequency > low) & (run.sweep.frequency < high)
    beside = (run.sweep.frequency > high + 1.5) & (run.sweep.frequency < high + 2.5)
    assert np.max(moved[own]) == 0
    assert np.max(moved[beside]) > 1e-4

"""Runs of one motorcycle do not differ; another motorcycle does, and it is named."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipbench.identification.commands import write_comparison
from slipbench.identification.models.study import study_of
from slipbench.identification.response.identify import identify
from slipbench.identification.session.comparison import compare, holm
from slipbench.identification.session.comparison_page import lines
from slipbench.protocol.errors import InputError
from tests.identification.synthetic_recording import Truth, recording

NOISE = 0.03


def ridden(name, **truth):
    made = replace(recording(Truth(noise=NOISE, **truth)), folder=Path(name))
    found = identify(made)
    return found, study_of(found)


@pytest.fixture(scope="module")
def alike():
    return [ridden(f"run{seed}", seed=seed) for seed in range(3)]


@pytest.fixture(scope="module")
def other():
    return ridden("other", seed=9, frequency=8.6, damping=0.3)


def test_repeats_do_not_differ_and_their_pool_is_nearer_to_the_truth(alike):
    found = compare(alike)
    assert not any(one.significant for one in found.differences)
    assert all(not p.probability < 0.05 for p in found.parameters)
    assert "do not differ" in found.headline
    truth = Truth().response(found.pooled.frequency)
    known = found.pooled.reliable
    off = [np.abs(r.value / truth - 1)[known].mean() for r in (f.main for f, _ in alike)]
    assert np.abs(found.pooled.value / truth - 1)[known].mean() < np.mean(off)
    assert found.pooled.deviation[known].mean() < alike[0][0].main.deviation[known].mean()


def test_another_motorcycle_is_named_with_the_parameter_that_differs(alike, other):
    found = compare([*alike, other])
    assert [one.run for one in found.differences if one.significant] == ["other"]
    frequency = next(p for p in found.parameters if p.name == "natural frequency")
    assert frequency.probability < 0.05
    assert "other differs" in found.headline
    own = found.validation["run0", "run1"].fit
    assert found.validation["run0", "other"].fit < own - 10


def test_two_runs_are_tested_once(alike, other):
    found = compare([alike[0], other])
    assert len(found.differences) == 1
    assert found.headline == "run0 and other differ beyond their intervals."


def test_probabilities_are_corrected_for_their_number():
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert holm([]) == []


def test_runs_without_a_common_response_are_refused(alike):
    rest = replace(recording(Truth(noise=NOISE), phases=False), folder=Path("log"))
    found = identify(rest)
    with pytest.raises(InputError, match="fewer than two runs"):
        compare([alike[0], (found, study_of(found))])


def test_the_page_stands_alone_and_names_every_run(alike, tmp_path):
    said, path = write_comparison(alike, tmp_path, tmp_path / "figures")
    text = path.read_text(encoding="utf-8")
    assert said[0] == lines(compare(alike))[0]
    for name in ("run0", "run1", "run2"):
        assert name in text
    assert len(text) < 5e6
    assert (tmp_path / "figures" / "comparison.png").stat().st_size > 10_000
    tree = json.loads((tmp_path / "comparison.json").read_text(encoding="utf-8"))
    assert [one["run"] for one in tree["runs"]] == ["run0", "run1", "run2"]

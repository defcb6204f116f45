"""Published benchmarks: the split is kept, and the error of the true model is its noise."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from benchmarks.outside.benchmarks import BENCHMARKS
from benchmarks.outside.error import error_on
from benchmarks.outside.page import page
from benchmarks.real.cases import CAPTURES
from slipbench.identification.mismatch.simulation.piece import Piece
from tests.identification.mismatch.laws import spring as springs
from tests.paths import MODELS, ROLES

OFFICIAL = {"multisine": 21688, "arrow, full": 40475, "arrow, no extrapolation": 32000}
"""Samples of the tests of the Silverbox, by the official loader."""
PERIOD = 1.6384e-3  # s


@pytest.mark.parametrize("benchmark", BENCHMARKS, ids=lambda b: b.name)
def test_no_test_datum_is_in_the_analysis(benchmark):
    used = [Piece.of(Path(run)) for run in (*benchmark.training, *benchmark.held_out)]
    tests = [Piece.of(Path(test.run)) for test in benchmark.tests]
    assert not [a for a, b in product(used, tests) if a.meets(b)]


@pytest.mark.parametrize("benchmark", BENCHMARKS, ids=lambda b: b.name)
def test_every_figure_is_of_a_test_and_has_a_source(benchmark):
    assert {f.test for f in benchmark.figures} == {t.name for t in benchmark.tests}
    assert all(f.source and f.method and f.value > 0.0 for f in benchmark.figures)
    runs = (*benchmark.training, *benchmark.held_out, *(t.run for t in benchmark.tests))
    assert {r.partition("@")[0] for r in runs} <= {c.name for c in CAPTURES}
    assert (MODELS / f"{benchmark.model}.toml").exists()


def test_the_segments_of_the_silverbox_have_the_official_numbers_of_samples():
    [silverbox] = [b for b in BENCHMARKS if b.name == "silverbox"]
    assert f'"{PERIOD * 1e3:g} ms"' in (ROLES / "silverbox.toml").read_text("utf-8")
    time = PERIOD * np.arange(131072)
    for test in silverbox.tests:
        piece = Piece.of(Path(test.run))
        inside = (time >= piece.start) & (time < piece.end)
        assert int(inside.sum()) == OFFICIAL[test.name]
    training = [Piece.of(Path(run)) for run in (*silverbox.training, *silverbox.held_out)]
    assert all(time[40650] <= p.start < p.end <= time[105712] for p in training)


@pytest.mark.parametrize("start", [0.0, 0.5])
def test_the_error_of_the_true_model_is_the_noise_wherever_it_starts(tmp_path, start):
    noise = 2e-3
    system = springs.spring(tmp_path)
    truth = {"gain": springs.GAIN, "frequency": springs.FREQUENCY, "damping": springs.DAMPING}
    true = replace(system, values=np.array([truth[name] for name in system.equations.parameters]))
    recording = springs.swung(1, noise=noise, start=start)
    found = error_on(true, recording, 50, noise)
    assert found.rms == pytest.approx(noise, rel=0.1)
    assert 940 < found.samples <= 950
    assert error_on(system, recording, 50, noise).rms > 10 * noise


def test_what_comes_after_the_first_samples_does_not_set_the_initial_state(tmp_path):
    system = springs.spring(tmp_path)
    recording = springs.swung(1, start=0.5)
    place = recording.channels["place"]
    value = place.value.copy()
    value[60:] += 1.0
    shifted = replace(place, value=value)
    other = replace(recording, channels={**recording.channels, "place": shifted})
    both = [error_on(system, r, 50, 2e-3) for r in (recording, other)]
    assert both[1].rms ** 2 > both[0].rms ** 2 + 0.5


def test_a_benchmark_that_was_not_run_is_on_the_page():
    text = page({})
    assert text.count("Not run.") == len(BENCHMARKS)
    assert all(f"## {b.title}" in text for b in BENCHMARKS)

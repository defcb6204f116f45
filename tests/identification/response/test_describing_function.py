"""Laws of describing functions from slices."""

import numpy as np
import pytest

from slipbench.identification.response.describing_function import (
    NoHarmonics,
    between,
    per_amplitude,
    sliced,
)
from slipbench.identification.response.swept_run import SweptRun, moving, swept_run
from tests.identification.response.known_harmonics import RATE, Curved, coloured, sweep

AMPLITUDE = 0.04


def run(system, duration=60.0, noise=0.0, seed=0) -> SweptRun:
    u = AMPLITUDE * sweep(duration=duration)
    made = swept_run(u, system.answer(u) + coloured(u.size, seed, noise * AMPLITUDE), RATE)
    assert isinstance(made, SweptRun)
    return made


def error(found, system) -> np.ndarray:
    """Of first and second harmonic over the first's greatest, for every slice."""
    truth = system.harmonics(found.frequency, AMPLITUDE)
    return np.asarray(np.abs(found.value - truth)[:2] / np.abs(truth[0]).max())


def test_a_slow_sweep_gives_the_harmonics_and_a_slower_one_gives_them_better():
    slow, slower = (error(sliced([run(Curved(), duration)]), Curved()) for duration in (60, 240))
    print(f"largest errors: {slow.max(axis=1)}, {slower.max(axis=1)}")
    assert slow.max() < 0.06
    assert np.all(np.mean(slower**2, axis=1) < 0.4 * np.mean(slow**2, axis=1))


def test_scatter_of_slices_and_runs_holds_the_truth():
    system = Curved()
    found = sliced([run(system, 60.0, 0.1, seed) for seed in range(4)])
    truth = system.harmonics(found.frequency, AMPLITUDE)
    inside = np.abs(found.value - truth) < found.quantile * found.deviation
    assert inside.mean() > 0.9
    assert found.runs == 4


def test_harmonics_are_counted_from_the_phase_of_the_input():
    """A later start of the clock turns input and output; what is per amplitude stays."""
    output = np.array([[2 + 1j], [0.3 - 0.2j], [0.1j]])
    first = np.array([0.04 + 0.01j])
    turn = np.exp(1j * 0.7 * np.arange(1, 4))[:, None]
    assert np.allclose(per_amplitude(output * turn, first * turn[0]), per_amplitude(output, first))


def test_values_between_frequencies_keep_a_delay():
    f = np.linspace(1, 10, 60)
    delayed = np.exp(-2j * np.pi * f * 0.05)[None]
    at = np.linspace(1.05, 9.9, 33)
    assert np.allclose(between(at, f, delayed)[0], np.exp(-2j * np.pi * at * 0.05))


def test_rest_before_and_after_a_sweep_is_left_out():
    wave = sweep(duration=10.0)
    rested = np.concatenate((np.zeros(500), wave, np.zeros(700)))
    part = moving(rested)
    assert abs(part.start - 500) <= 1
    assert part.stop == pytest.approx(500 + wave.size, abs=2)


def test_too_few_slices_are_refused_in_words():
    found = sliced([run(Curved(), 4.0)])
    assert isinstance(found, NoHarmonics)
    assert "slices" in found.reason
    assert isinstance(sliced([]), NoHarmonics)

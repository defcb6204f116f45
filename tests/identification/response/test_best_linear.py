"""Laws of the best linear approximation: noise, even and odd distortion told apart."""

import numpy as np
import pytest

from slipbench.identification.response.best_linear import (
    BestLinearApproximation,
    NoBestLinear,
    best_linear,
)
from slipbench.identification.response.periodic_record import PeriodicRecord, lines_of
from slipbench.protocol.waveforms import odd_multisine
from slipbench.studies.paper.harmonic_figures import linear_figure
from tests.identification.response.known_harmonics import RATE, Curved, coloured, drift

AMPLITUDE, PERIOD = 0.06, 4.0
COVERED = np.sqrt(-np.log(0.05))
LINEAR, SQUARE, CUBE = (Curved(square=s, cube=c) for s, c in ((0, 0), (6, 0), (0, 200)))


def record(system, seed, noise=0.0003, periods=6, detection=True) -> PeriodicRecord:
    time = np.arange(int(periods * PERIOD * RATE)) / RATE
    u = AMPLITUDE * odd_multisine(time, PERIOD, 0.5, 12.0, seed, detection)
    wander = drift(u.size, seed, 0.002) * (noise > 0)
    return PeriodicRecord(
        u, system.answer(u) + coloured(u.size, seed, noise) + wander, RATE, PERIOD
    )


def found(system, realisations=6, **changes) -> BestLinearApproximation:
    result = best_linear([record(system, seed, **changes) for seed in range(realisations)])
    assert isinstance(result, BestLinearApproximation)
    return result


def test_a_linear_system_without_noise_is_found_exactly():
    result = found(LINEAR, noise=0.0)
    truth = LINEAR.linear(result.frequency)
    assert np.max(np.abs(result.value - truth) / np.abs(truth)) < 2e-3
    assert max(np.max(result.even.level), np.max(result.odd.level)) < 2e-3


def test_the_noise_deviation_is_the_error_of_a_linear_system():
    squares = []
    for trial in range(6):
        seeds = range(10 * trial, 10 * trial + 3)
        result = best_linear([record(LINEAR, seed, noise=0.002) for seed in seeds])
        left = np.abs(result.value - LINEAR.linear(result.frequency))
        squares.append((left / result.noise_deviation) ** 2)
    print(f"mean square of error over deviation: {np.mean(squares):.3f}")
    assert np.mean(squares) == pytest.approx(1.0, abs=0.25)


@pytest.mark.parametrize(("system", "odd"), [(SQUARE, False), (CUBE, True)])
def test_even_and_odd_distortion_are_told_apart(system, odd):
    result = found(system)
    shown, silent = (result.odd, result.even) if odd else (result.even, result.odd)
    assert np.median(shown.level) > 10 * np.median(shown.noise)
    assert np.median(silent.level) < 1.5 * np.median(silent.noise)


def test_even_distortion_does_not_disturb_odd_lines_and_odd_distortion_does():
    even, odd = found(SQUARE), found(CUBE)
    assert np.median(even.total_deviation / even.noise_deviation) < 2
    assert np.median(odd.total_deviation / odd.noise_deviation) > 10


def test_the_total_deviation_holds_a_cube_as_its_best_linear_gain():
    """A cube acts as a gain, for all lines alike but for the terms of a line with itself."""
    result = found(CUBE)
    shape = CUBE.linear(result.frequency)
    gain = np.vdot(shape, result.value) / np.vdot(shape, shape)
    left = np.abs(result.value - gain * shape)
    assert gain.real > 1.05
    assert np.mean(left < COVERED * 1.2 * result.total_deviation) > 0.85


def test_one_realisation_is_judged_by_its_lines():
    alone, several = found(CUBE, realisations=1), found(CUBE)
    spread = np.median(several.total_deviation) * np.sqrt(6)
    assert np.median(alone.total_deviation) == pytest.approx(spread, rel=0.6)


def test_a_transient_is_not_taken_for_noise():
    quiet = lines_of(record(LINEAR, 1, noise=0.0))
    made = record(LINEAR, 1, noise=0.0)
    t = np.arange(made.y.size) / RATE
    faded = PeriodicRecord(made.u, made.y + 0.02 * np.exp(-t / 6), RATE, PERIOD)
    assert np.max(np.abs(lines_of(faded).y - quiet.y)[2:48]) < 2e-4


def test_it_becomes_a_frequency_response():
    response = found(CUBE).to_response()
    assert response.reliable.any()
    assert response.to_control().omega.size == np.count_nonzero(response.reliable)


def test_what_cannot_be_had_is_refused_in_words():
    assert isinstance(best_linear([]), NoBestLinear)
    short = best_linear([record(LINEAR, 1, periods=2)])
    assert isinstance(short, NoBestLinear)
    assert "periods" in short.reason
    other = PeriodicRecord(np.zeros(9000), np.zeros(9000), RATE, 1.0)
    assert "different periods" in best_linear([record(LINEAR, 1), other]).reason


def test_the_figure_has_gain_and_phase():
    assert len(linear_figure(found(CUBE)).axes) == 2

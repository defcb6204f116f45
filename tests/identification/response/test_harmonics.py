"""Laws of harmonics along the phase of a sweep."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.identification.response.describing_function import DescribingFunction, NoHarmonics
from slipbench.identification.response.harmonics import harmonics
from slipbench.identification.response.swept_run import SweptRun, swept_run
from slipbench.identification.signals.swept_phase import NoSweep, SweptPhase, swept_phase
from slipbench.studies.paper.harmonic_claims import describing_function_claims
from slipbench.studies.paper.harmonic_figures import describing_figure
from tests.identification.response.known_harmonics import RATE, Curved, coloured, drift, sweep

AMPLITUDE = 0.04
COVERED = np.sqrt(-np.log(0.05))  # 95 % of a complex normal value lie inside this many deviations


def run(system, duration=30.0, law="linear", noise=0.0, seed=0) -> SweptRun:
    u = AMPLITUDE * sweep(duration=duration, law=law)
    y = system.answer(u) + coloured(u.size, seed, noise * AMPLITUDE)
    y += drift(u.size, seed, 0.002) * (noise > 0)
    made = swept_run(u, y, RATE)
    assert isinstance(made, SweptRun)
    return made


def error(found: DescribingFunction, system: Curved, k: int) -> float:
    """Root mean square error of the k-th harmonic from 1 to 11 Hz, beside the truth's."""
    inside = (found.frequency > 1) & (found.frequency < 11)
    truth = system.harmonics(found.frequency, AMPLITUDE)[k - 1]
    left = np.abs(found.value[k - 1] - truth)[inside]
    return float(np.sqrt(np.mean(left**2) / np.mean(np.abs(truth[inside]) ** 2)))


@pytest.mark.parametrize("law", ["linear", "logarithmic"])
def test_known_harmonics_come_back_without_noise(law):
    found = harmonics([run(Curved(), law=law)])
    assert error(found, Curved(), 1) < 0.01
    assert error(found, Curved(), 2) < 0.02
    assert error(found, Curved(), 3) < 0.05


def test_a_fast_sweep_is_not_late():
    """The stationary phase's second term: without it the first harmonic is 3 % off in 12 s."""
    assert error(harmonics([run(Curved(), duration=12.0)]), Curved(), 1) < 0.006


def test_a_linear_system_has_no_harmonics():
    found = harmonics([run(Curved(square=0, cube=0))])
    inside = (found.frequency > 1) & (found.frequency < 11)
    assert np.max(found.gain[1:, inside] / found.gain[0, inside]) < 0.003


def test_the_truth_lies_inside_the_bands_under_coloured_noise():
    system, inside = Curved(), []
    for seed in range(12):
        found = harmonics([run(system, noise=0.1, seed=seed)])
        band = (found.frequency > 1) & (found.frequency < 11)
        left = np.abs(found.value - system.harmonics(found.frequency, AMPLITUDE))[:, band]
        inside.append(left < COVERED * found.quantile / 1.96 * found.deviation[:, band])
    shares = np.mean(inside, axis=(0, 2))
    print(f"covered: {shares}")
    assert (shares > 0.87).all()


def test_more_runs_err_less():
    system = Curved()
    runs = [run(system, noise=0.1, seed=seed) for seed in range(8)]
    alone = np.mean([error(harmonics([one]), system, 2) for one in runs])
    assert error(harmonics(runs), system, 2) < 0.5 * alone


def test_the_trend_does_not_leak_into_harmonics():
    made = run(Curved())
    t = np.arange(made.y.size) / RATE
    plain = harmonics([made])
    slow = 0.02 * np.sin(2 * np.pi * 0.03 * t) + 0.001 * t
    bent = harmonics([SweptRun(made.u, made.y + slow, RATE, made.sweep)])
    inside = plain.frequency > 1
    assert np.max(np.abs(bent.value - plain.value)[:, inside]) < 1e-4


@given(gain=st.floats(0.01, 100), shift=st.floats(-5, 5))
@settings(max_examples=5, deadline=None)
def test_the_output_scales_and_its_mean_does_not_matter(gain, shift):
    made = run(Curved(), duration=12.0)
    plain = harmonics([made])
    other = harmonics([SweptRun(made.u, gain * (made.y + shift), RATE, made.sweep)])
    assert np.allclose(other.value, gain * plain.value, atol=1e-6 * gain)


@given(
    start=st.floats(0.2, 2),
    stop=st.floats(5, 20),
    duration=st.floats(8, 40),
    law=st.sampled_from(["linear", "logarithmic"]),
)
@settings(max_examples=15, deadline=None)
def test_the_phase_of_any_sweep_is_found_from_the_sweep(start, stop, duration, law):
    u = 0.09 + 0.03 * sweep(start, stop, duration, law)
    found = swept_phase(u, RATE)
    assert isinstance(found, SweptPhase)
    assert found.law == law
    assert found.frequency[[0, -1]] == pytest.approx([start, stop], rel=5e-3)
    assert found.unexplained < 1e-3


def test_what_is_no_sweep_is_refused_in_words():
    noise = np.random.default_rng(1).normal(size=20_000)
    for u in (noise, np.zeros(5_000), np.linspace(0, 1, 5_000)):
        made = swept_run(u, u, RATE)
        assert isinstance(made, NoSweep)
        assert made.reason
    assert isinstance(harmonics([]), NoHarmonics)
    short = run(Curved(), duration=2.0)
    assert isinstance(harmonics([short]), NoHarmonics)


def test_claims_and_figure_of_a_known_system():
    """A curve before a resonance at 8 Hz: the second harmonic peaks at half of it, the paper's
    does not, and the claim says so."""
    found = harmonics([run(Curved(damping=0.2))])
    claims = {claim.name: claim for claim in describing_function_claims(found, found, 10.0)}
    assert claims["first_harmonic_resonance_throttle"].holds
    second = claims["second_harmonic_resonance_throttle"]
    assert second.value == pytest.approx(0.39, abs=0.03)
    assert not second.holds
    unknown = describing_function_claims(NoHarmonics("no run"), None)
    assert not any(claim.holds for claim in unknown)
    assert all(claim.note == "no run" for claim in unknown)
    assert len(describing_figure(found, found).axes) == 3

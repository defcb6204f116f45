"""Frequency responses: a gain is the gain, a delay is linear phase, noise lowers the coherence."""

import itertools

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from slipbench.identification.response.local_polynomial import sweep_response
from slipbench.identification.response.periodic import periodic_response
from slipbench.identification.response.resonance import (
    NoResonance,
    Resonance,
    low_frequency_delay,
    resonance,
)
from tests.identification.synthetic_recording import sweep

RATE = 1000.0
T = np.arange(0, 24, 1 / RATE)
BAND = (0.5, 15.0)
U = sweep(T - 2, 20.0)


def second_order(u, frequency=8.0, damping=0.25, rate=RATE):
    w = 2 * np.pi * frequency
    b, a, _ = signal.cont2discrete(([w**2], [1, 2 * damping * w, w**2]), 1 / rate, "foh")
    return signal.lfilter(b[0], a, u)


def truth(f, frequency=8.0, damping=0.25):
    w, s = 2 * np.pi * frequency, 2j * np.pi * f
    return w**2 / (s**2 + 2 * damping * w * s + w**2)


@given(gain=st.floats(1e-3, 1e3))
@settings(max_examples=20, deadline=None)
def test_the_response_of_a_gain_is_the_gain(gain):
    found = sweep_response(U, gain * U, RATE, BAND)
    np.testing.assert_allclose(found.value, gain, rtol=1e-6)
    np.testing.assert_allclose(found.coherence, 1.0, atol=1e-9)


@given(steps=st.integers(1, 60))
@settings(max_examples=20, deadline=None)
def test_a_pure_delay_is_a_linear_phase(steps):
    found = sweep_response(U, np.roll(U, steps), RATE, BAND)
    expected = -2 * np.pi * found.frequency * steps / RATE
    np.testing.assert_allclose(found.phase, expected, atol=0.02)
    assert low_frequency_delay(found) == pytest.approx(steps / RATE, abs=2e-4)


@pytest.mark.parametrize("frequency", [3.0, 5.0, 8.0])
def test_the_low_frequency_delay_of_a_resonance_is_that_below_it(frequency):
    """Of w^2 / (s^2 + 2 d w s + w^2) it is 2 d / w at frequency 0; its peak turns the phase."""
    found = sweep_response(U, second_order(U, frequency, 0.1), RATE, BAND)
    peak = resonance(found)
    assert isinstance(peak, Resonance)
    exact = 2 * 0.1 / (2 * np.pi * frequency)
    assert exact < low_frequency_delay(found, peak.frequency) < 1.5 * exact


@given(a=st.floats(0.01, 100), b=st.floats(0.01, 100))
@settings(max_examples=20, deadline=None)
def test_scaling_input_and_output_scales_the_response_and_nothing_else(a, b):
    y = second_order(U) + 0.02 * np.random.default_rng(1).standard_normal(T.size)
    one, two = sweep_response(U, y, RATE, BAND), sweep_response(a * U, b * y, RATE, BAND)
    np.testing.assert_allclose(two.value, one.value * b / a, rtol=1e-6)
    np.testing.assert_allclose(two.coherence, one.coherence, atol=1e-6)


def test_known_dynamics_are_recovered_within_one_percent_and_one_degree():
    found = sweep_response(U, second_order(U), RATE, BAND)
    ratio = (found.value / truth(found.frequency))[2:-2]
    assert np.max(np.abs(np.abs(ratio) - 1)) < 0.01
    assert np.max(np.abs(np.degrees(np.angle(ratio)))) < 1.0


def test_a_slow_drift_does_not_reach_the_response():
    drifting = second_order(U) + 0.05 * T + 3.0
    found = sweep_response(U, drifting, RATE, BAND)
    inside = found.frequency > 1.0
    error = np.abs(found.value / truth(found.frequency) - 1)[inside]
    assert np.median(error) < 0.01


def test_coherence_falls_with_noise():
    noise = np.random.default_rng(2).standard_normal(T.size)
    medians = [
        np.median(sweep_response(U, second_order(U) + level * noise, RATE, BAND).coherence)
        for level in (0.0, 0.5, 2.0, 8.0)
    ]
    assert all(a > b for a, b in itertools.pairwise(medians))
    assert medians[0] > 0.999
    assert medians[-1] < 0.8


def test_an_output_that_does_not_answer_has_no_coherence_and_no_resonance():
    found = sweep_response(U, np.random.default_rng(3).standard_normal(T.size), RATE, BAND)
    assert np.median(found.coherence) < 0.3
    assert isinstance(resonance(found), NoResonance)


def test_the_confidence_band_covers_the_truth_as_often_as_it_says():
    covered = []
    for seed in range(40):
        noise = np.random.default_rng(seed).standard_normal(T.size)
        found = sweep_response(U, second_order(U) + 0.3 * noise, RATE, BAND)
        inside = np.abs(found.gain - np.abs(truth(found.frequency))) < found.gain_band
        covered.append(inside[5:-5:12])
    assert 0.90 < np.mean(covered) < 0.985


@pytest.mark.parametrize("damping", [0.15, 0.25, 0.35])
def test_the_resonance_is_found(damping):
    found = resonance(sweep_response(U, second_order(U, damping=damping), RATE, BAND))
    assert isinstance(found, Resonance)
    assert found.frequency == pytest.approx(8 * np.sqrt(1 - 2 * damping**2), rel=0.01)
    expected = 1 / (2 * damping * np.sqrt(1 - damping**2))
    assert found.peak == pytest.approx(expected, rel=0.03)


def test_a_first_order_lag_has_no_resonance():
    b, a, _ = signal.cont2discrete(([1.0], [0.05, 1]), 1 / RATE, "foh")
    found = resonance(sweep_response(U, signal.lfilter(b[0], a, U), RATE, BAND))
    assert isinstance(found, NoResonance)


def test_a_multisine_is_read_at_its_lines():
    period, lines = 4.0, np.arange(3.0, 60, 2)
    phases = np.random.default_rng(4).uniform(0, 2 * np.pi, lines.size)
    u = np.sin(2 * np.pi * np.outer(T, lines) / period + phases).sum(axis=1)
    y = second_order(u) + 0.05 * np.random.default_rng(5).standard_normal(T.size)
    found = periodic_response(u, y, RATE, period, lines)
    np.testing.assert_allclose(found.frequency, lines / period)
    np.testing.assert_allclose(found.value, truth(found.frequency), rtol=0.03, atol=0.01)
    assert found.coherence.min() > 0.98


def test_a_square_wave_is_read_at_its_odd_harmonics():
    u = signal.square(2 * np.pi * T)
    found = periodic_response(u, second_order(u), RATE, 1.0, np.arange(1.0, 30, 2))
    np.testing.assert_allclose(found.value, truth(found.frequency), rtol=0.03, atol=0.01)


def test_too_short_a_record_is_refused_in_words():
    with pytest.raises(ValueError, match="too short"):
        sweep_response(U[:500], U[:500], RATE, BAND)
    with pytest.raises(ValueError, match="periods"):
        periodic_response(U[:3000], U[:3000], RATE, 2.0, np.array([1.0]))


def test_the_response_becomes_a_python_control_object():
    found = sweep_response(U, second_order(U), RATE, BAND, ("throttle_command", "slip"))
    other = found.to_control()
    assert isinstance(other, control.FrequencyResponseData)
    assert (other.input_labels, other.output_labels) == (["throttle_command"], ["slip"])
    np.testing.assert_allclose(np.asarray(other.frdata).ravel(), found.value)
    np.testing.assert_allclose(other.omega, 2 * np.pi * found.frequency)

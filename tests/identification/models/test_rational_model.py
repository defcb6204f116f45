"""A rational model: its answer in time is its answer in frequency, in every form."""

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from tests.identification.response.known_lines import chain

RATE = 1000.0
F = np.array([0.5, 2.0, 8.6, 11.0])


@given(delay=st.floats(0, 0.03), f=st.sampled_from([1.0, 4.0, 9.0]))
@settings(max_examples=15, deadline=None)
def test_a_slow_sine_comes_out_as_the_response_says(delay, f):
    model, t = chain(delay), np.arange(0, 6, 1 / RATE)
    y = model.simulate(np.sin(2 * np.pi * f * t), RATE)[3000:]
    wave = np.exp(-2j * np.pi * f * t[3000:])
    found = 2j * np.mean(y * wave)
    hold = np.exp(-1j * np.pi * f / RATE) * np.sinc(f / RATE)
    assert found == pytest.approx(model.response(np.array([f]))[0] * hold, rel=1e-4)


def test_whole_samples_of_delay_shift_the_answer():
    u = np.random.default_rng(1).standard_normal(500)
    early, late = (chain(d).simulate(u, RATE) for d in (0.0, 0.020))
    np.testing.assert_allclose(late[20:], early[:-20], atol=1e-12)


def test_parts_of_a_sample_lie_between_its_neighbours():
    u = np.r_[np.zeros(10), np.ones(490)]
    a, b, c = (chain(d).simulate(u, RATE) for d in (0.010, 0.0104, 0.011))
    rising = slice(25, 45)
    assert np.all((b < a)[rising] & (b > c)[rising])


def test_it_begins_in_the_steady_state_of_its_first_input():
    y = chain().simulate(np.full(300, 3.0), RATE)
    np.testing.assert_allclose(y, 3.0 * 0.17, rtol=1e-9)


def test_a_held_input_is_simulated_exactly():
    model, u = chain(0.0), np.random.default_rng(2).standard_normal(400)
    u[0] = 0
    system = (model.numerator, model.denominator)
    b, a, _ = signal.cont2discrete(system, 1 / RATE, "zoh")
    np.testing.assert_allclose(model.simulate(u, RATE), signal.lfilter(b[0], a, u), atol=1e-9)


def test_python_control_gets_the_same_response_with_names():
    model = chain(zeros=(-60.0,))
    for given_ in (model.to_control(), model.to_state_space()):
        assert given_.input_labels == ["u"]
        assert given_.output_labels == ["y"]
        found = np.array([control.evalfr(given_, 2j * np.pi * f) for f in F])
        np.testing.assert_allclose(found, model.without_delay.response(F), rtol=1e-8)
    late = model.to_control(pade=4)
    found = np.array([control.evalfr(late, 2j * np.pi * f) for f in F])
    np.testing.assert_allclose(found, model.response(F), rtol=1e-6)


def test_a_zero_on_the_right_is_not_minimum_phase():
    assert chain(zeros=(-60.0,)).minimum_phase
    wrong = chain(zeros=(60.0,))
    assert not wrong.minimum_phase
    assert wrong.right_zeros == pytest.approx([60.0])

"""What a controller runs sees no future, keeps no past that grows, and costs what it says."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from slipbench.controllers.causal_filters import (
    LowPass,
    Notch,
    notched_online,
    smoothed_online,
    wheel_follower,
)
from slipbench.identification.signals.filters import low_pass, notch

RATE = 1000.0
T = np.arange(0, 12, 1 / RATE)


def passed(value, frequency):
    """Complex gain of a sine of 1 at `frequency`, once it has settled; a cosine window."""
    late = T > 4
    wave = np.exp(-2j * np.pi * frequency * T[late]) * np.hanning(late.sum())
    return 2j * np.sum(wave * value[late]) / np.hanning(late.sum()).sum()


@given(cutoff=st.floats(1, 200), order=st.sampled_from([2, 4, 6]), rest=st.floats(-90, 90))
@settings(max_examples=25, deadline=None)
def test_the_low_pass_is_scipys_sample_by_sample(cutoff, order, rest):
    value = rest + np.random.default_rng(1).standard_normal(300)
    value[0] = rest
    sections = signal.butter(order, cutoff, fs=RATE, output="sos")
    wanted, _ = signal.sosfilt(sections, value, zi=signal.sosfilt_zi(sections) * rest)
    found = smoothed_online(value, LowPass(RATE, cutoff, order))
    np.testing.assert_allclose(found, wanted, atol=1e-9)


@given(frequency=st.floats(1, 60), cutoff=st.floats(10, 100))
@settings(max_examples=20, deadline=None)
def test_the_low_pass_costs_what_it_says(frequency, cutoff):
    smooth = LowPass(RATE, cutoff)
    found = passed(smoothed_online(np.sin(2 * np.pi * frequency * T), smooth), frequency)
    assert found == pytest.approx(smooth.response(np.array([frequency]))[0], abs=2e-3)


@given(frequency=st.floats(1, 60), wheel=st.floats(4, 30), width=st.floats(0.3, 2.0))
@settings(max_examples=20, deadline=None)
def test_the_notch_costs_what_it_says(frequency, wheel, width):
    held = Notch(RATE, (1, 2), width)
    wave = np.sin(2 * np.pi * frequency * T)
    found = passed(notched_online(wave, np.full_like(T, wheel), held), frequency)
    assert found == pytest.approx(held.response(np.array([frequency]), wheel)[0], abs=0.03)


def test_the_notch_is_of_second_order():
    f, wheel, width = np.array([3.0, 8.0, 10.0, 20.0]), 9.0, 0.5
    s, w, b = 2j * np.pi * f, 2 * np.pi * wheel, 2 * np.pi * width
    paper = (s**2 + w**2) / (s**2 + 2 * b * s + w**2)
    np.testing.assert_allclose(Notch(RATE, (1,), width).response(f, wheel), paper, atol=0.02)
    assert abs(Notch(RATE).response(np.array([wheel]), wheel)[0]) < 1e-9


def riding(ramp):
    speed = 50 + ramp * T
    angle = np.cumsum(speed) / RATE / 0.32
    return speed, angle, speed + 0.2 * np.sin(angle + 0.4)


@pytest.mark.parametrize("ramp", [0.0, 0.2, 0.5])
def test_the_notch_follows_a_wheel_that_speeds_up(ramp):
    speed, angle, read = riding(ramp)
    led = smoothed_online(read, wheel_follower(RATE)) / (2 * np.pi * 0.32)
    left = notched_online(read, led, Notch(RATE)) - speed
    late = T > 6
    assert 2 * abs(np.mean(left[late] * np.exp(-1j * angle[late]))) < 0.2 * 10 ** (-15 / 20)


def test_forwards_and_backwards_nothing_is_late():
    wheel = np.full_like(T, 26.5)
    wave = np.sin(2 * np.pi * 10.0 * T)
    for found in (notch(wave, wheel, RATE), low_pass(wave, RATE, 60.0)):
        assert abs(np.degrees(np.angle(passed(found, 10.0)))) < 0.1
    price = np.angle(LowPass(RATE, 60.0).response(np.array([10.0])))[0]
    assert -26 < np.degrees(price) < -23


def test_the_future_does_not_matter_and_the_state_does_not_grow():
    speed, _, read = riding(0.2)
    held, smooth = Notch(RATE, (1, 2, 3)), LowPass(RATE, 60.0)
    wheel = speed / (2 * np.pi * 0.32)
    whole, part = (notched_online(read[:n], wheel[:n], held) for n in (2000, 1000))
    np.testing.assert_array_equal(whole[:1000], part)
    state, start = held.initial(), smooth.initial(1.0)
    for value in read[:50]:
        _, state = held.update(state, value, 26.0)
        _, start = smooth.update(start, value)
    assert len(state.lines) == 3
    assert len(start) == len(smooth.initial(1.0))


def test_an_unknown_sample_stays_unknown_and_spoils_nothing():
    held = Notch(RATE)
    _, state = held.update(held.initial(), 1.0, 26.0)
    clean, after = held.update(state, np.nan, 26.0)
    assert np.isnan(clean)
    assert after.lines == state.lines


@pytest.mark.parametrize("orders", [(1,), (1, 2, 5)])
def test_the_impulse_response_of_a_notch_is_what_it_says(orders):
    """Wide, so that it dies away within a second: its Fourier transform is the response."""
    held, wheel = Notch(RATE, orders, 8.0), 23.0
    impulse = np.zeros(2000)
    impulse[0] = 1.0
    out = notched_online(impulse, np.full_like(impulse, wheel), held)
    frequency = np.array([1.0, 23.0, 31.0, 46.0, 100.0, 115.0, 300.0])
    angle = 2j * np.pi * np.outer(frequency, np.arange(2000)) / RATE
    np.testing.assert_allclose(np.exp(-angle) @ out, held.response(frequency, wheel), atol=1e-9)


def test_the_impulse_response_of_a_low_pass_is_what_it_says():
    smooth = LowPass(RATE, 40.0)
    impulse = np.zeros(2000)
    impulse[1] = 1.0
    out = smoothed_online(impulse, smooth)[1:]
    frequency = np.array([1.0, 23.0, 40.0, 115.0, 300.0])
    angle = 2j * np.pi * np.outer(frequency, np.arange(1999)) / RATE
    found = smooth.response(frequency)
    np.testing.assert_allclose(np.exp(-angle) @ out, found, atol=1e-9)
    assert abs(found[2]) == pytest.approx(0.5**0.5)


def test_a_wheel_follower_is_of_second_order_at_one_hertz():
    follower = wheel_follower(RATE)
    assert (follower.rate, follower.order) == (RATE, 2)
    assert abs(follower.response(np.array([1.0]))[0]) == pytest.approx(0.5**0.5)
    delay = -np.angle(follower.response(np.array([0.01])))[0] / (2 * np.pi * 0.01)
    assert delay == pytest.approx(0.23, abs=0.006)


def test_the_angle_of_a_notch_turns_with_the_wheel_and_stays_within_a_turn():
    held, state, turned = Notch(RATE), Notch(RATE).initial(), 0.0
    for _ in range(200):
        _, state = held.update(state, 1.0, 26.0)
        turned = (turned + 2 * np.pi * 26.0 / RATE) % (2 * np.pi)
        assert state.angle == pytest.approx(turned, abs=1e-9)


@pytest.mark.parametrize("value", [0.0, 7.0, -3.0])
def test_a_low_pass_that_starts_at_rest_gives_what_it_is_given(value):
    smooth = LowPass(RATE, 40.0)
    state = smooth.initial(value) if value else smooth.initial()
    for _ in range(5):
        out, state = smooth.update(state, value)
        assert out == pytest.approx(value, abs=1e-12)

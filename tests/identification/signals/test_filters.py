"""The notch takes the wheel's own line off and leaves the rest where it was."""

import numpy as np
import pytest

from slipbench.identification.signals.filters import (
    line_reduction,
    low_pass,
    notch,
    wheel_frequency,
)

RATE, RADIUS = 1000.0, 0.32
T = np.arange(0, 20, 1 / RATE)


def spinning(ramp=0.2):
    """A speed that grows, its true wheel angle and a 1X line of 0.3 m/s."""
    speed = 50 + ramp * T
    angle = np.cumsum(speed) / RATE / RADIUS
    return speed, angle, 0.3 * np.sin(angle + 0.4)


@pytest.mark.parametrize("ramp", [0.0, 0.2, 0.5])
def test_the_line_is_removed_while_the_wheel_speeds_up(ramp):
    speed, angle, line = spinning(ramp)
    read = speed + line
    cleaned = notch(read, wheel_frequency(read, RATE, RADIUS), RATE)
    middle = slice(3000, -3000)
    assert line_reduction((read - speed)[middle], (cleaned - speed)[middle], angle[middle]) > 25


@pytest.mark.parametrize("frequency", [1.0, 5.0, 10.0, 15.0, 40.0])
def test_other_frequencies_keep_amplitude_and_phase(frequency):
    speed, _, line = spinning()
    wave = 0.2 * np.sin(2 * np.pi * frequency * T)
    read = speed + line + wave
    frequencies = wheel_frequency(read, RATE, RADIUS)
    left = notch(read, frequencies, RATE) - notch(speed + line, frequencies, RATE)
    carrier = np.exp(-2j * np.pi * frequency * T)[3000:-3000]
    gain = np.mean(left[3000:-3000] * carrier) / np.mean(wave[3000:-3000] * carrier)
    assert abs(gain) == pytest.approx(1, abs=0.01)
    assert abs(np.degrees(np.angle(gain))) < 0.2


def test_the_second_order_is_left_to_its_own_notch():
    speed, angle, _ = spinning()
    read = speed + 0.3 * np.sin(2 * angle)
    frequencies = wheel_frequency(read, RATE, RADIUS)
    middle = slice(3000, -3000)
    first, second = (notch(read, frequencies, RATE, order) - speed for order in (1, 2))
    kept = line_reduction((read - speed)[middle], first[middle], 2 * angle[middle])
    gone = line_reduction((read - speed)[middle], second[middle], 2 * angle[middle])
    assert abs(kept) < 0.2
    assert gone > 25


def test_unknown_samples_stay_unknown():
    speed, _, line = spinning()
    read = speed + line
    read[5000:5050] = np.nan
    assert np.isnan(notch(read, wheel_frequency(read, RATE, RADIUS), RATE)).sum() == 50
    assert np.isnan(low_pass(read, RATE, 60.0)).sum() == 50


def test_the_low_pass_has_no_phase():
    wave = np.sin(2 * np.pi * 10 * T)
    smooth = low_pass(wave, RATE, 60.0)
    np.testing.assert_allclose(smooth[1000:-1000], wave[1000:-1000], atol=1e-3)

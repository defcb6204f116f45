"""Noise of the reference leaves the response of slip if the vehicle is a mass, and only then."""

import numpy as np
import pytest
from scipy import signal

from slipbench.identification.response.local_polynomial import sweep_response
from slipbench.identification.response.quiet_reference import with_quiet_reference

RATE, BAND, SPEED, STIFFNESS = 200.0, (0.5, 12.0), 50.0, 4.3  # Hz, Hz, m/s, 1/s
SEEDS = range(5)
SLIP = signal.bilinear(
    [0.15 * (2 * np.pi * 8) ** 2], [1, 2 * 0.25 * 2 * np.pi * 8, (2 * np.pi * 8) ** 2], RATE
)


def recorded(seed, noise=0.02, ringing=0.0):
    """Ride a sweep of a linear tyre on a mass. ringing: m/s that the reference rings per input."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 34, 1 / RATE)
    x = np.clip(t - 2, 0, 30)
    turns = BAND[0] * x + (BAND[1] - BAND[0]) * x**2 / 60
    u = np.where((t >= 2) & (t < 32), 0.02 * np.sin(2 * np.pi * turns), 0.0)
    moved = signal.lfilter(*SLIP, u) + 2e-4 * rng.standard_normal(t.size)
    speed = SPEED * (1 + signal.lfilter([STIFFNESS / RATE], [1, -1 + 0.1 / RATE], moved))
    ring = signal.lfilter(*signal.bilinear([900.0], [1, 3.0, 900.0], RATE), u)
    seen = speed + ringing * ring + noise * rng.standard_normal(t.size)
    return u, speed * (1 + moved), seen


def responses(u, driven, seen):
    measured = driven / seen - 1
    raw = sweep_response(u, measured, RATE, BAND, ("throttle_position", "slip"))
    return raw, with_quiet_reference(raw, u, measured, driven, seen, RATE, BAND)


def truth(frequency):
    return signal.freqz(*SLIP, worN=frequency, fs=RATE)[1]


def test_the_noise_of_the_reference_is_gone_and_the_band_holds_what_is_left():
    before, after, held = [], [], []
    for seed in SEEDS:
        raw, quiet = responses(*recorded(seed))
        true = truth(raw.frequency)
        before.append(np.abs(raw.value / true - 1))
        after.append(np.abs(quiet.value / true - 1))
        held.append(np.abs(quiet.gain - np.abs(true)) < quiet.gain_band)
        assert np.all(quiet.deviation <= raw.deviation)
        assert np.all(quiet.coherence >= raw.coherence - 1e-12)
    print("seeds", list(SEEDS), np.median(before), np.median(after), np.mean(held))
    assert np.median(after) < 0.6 * np.median(before)
    assert np.mean(held) > 0.9


@pytest.mark.parametrize("ringing", [0.5, 5.0])
def test_a_reference_that_rings_by_itself_is_taken_as_it_is(ringing):
    for seed in SEEDS:
        raw, quiet = responses(*recorded(seed, ringing=ringing))
        assert quiet is raw, seed


def test_without_noise_nothing_is_taken_off():
    raw, quiet = responses(*recorded(1, noise=0.0))
    assert np.max(np.abs(quiet.value / raw.value - 1)) < 2e-3

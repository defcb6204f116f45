"""Laws of sampling: a channel tells the value of its own moments, in whole quanta."""

from dataclasses import replace

import numpy as np
import pytest

from slipbench.plant.channels import CHANNEL_UNITS, DEFAULT_CHANNELS, ChannelTiming, sample


def test_samples_fall_on_the_channels_own_times():
    t = np.arange(1, 4001) * 0.25e-3
    timing = ChannelTiming(period=4e-3)
    at, values = sample(t, 50 + 3 * t, timing, start=1e-3)
    assert np.diff(at) == pytest.approx(4e-3)
    assert at[0] == pytest.approx(1e-3)
    assert values == pytest.approx(50 + 3 * at)


def test_pieces_of_a_record_sample_the_same_moments():
    t = np.arange(1, 4001) * 0.25e-3
    timing = replace(DEFAULT_CHANNELS["optical_speed"], period=4e-3)
    whole = sample(t, np.sin(t), timing)[0]
    pieces = [
        sample(t[i : i + 400], np.sin(t[i : i + 400]), timing)[0] for i in range(0, 4000, 400)
    ]
    assert np.concatenate(pieces) == pytest.approx(whole)


def test_a_quantum_is_the_smallest_difference_that_is_told():
    t = np.arange(1, 2001) * 1e-3
    timing = ChannelTiming(period=10e-3, quantum=0.25)
    values = sample(t, np.sin(9 * t), timing)[1]
    assert (values % 0.25 == 0).all()
    assert np.abs(values - np.sin(9 * sample(t, t, timing)[0])).max() <= 0.125 + 1e-4


def test_every_channel_has_a_unit_and_a_stated_default():
    assert set(DEFAULT_CHANNELS) == set(CHANNEL_UNITS)


def test_events_have_no_period_and_are_not_sampled():
    with pytest.raises(ValueError, match="every event"):
        sample(np.arange(3.0), np.arange(3.0), DEFAULT_CHANNELS["rear_teeth"])

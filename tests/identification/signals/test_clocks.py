"""A device's clock is recovered from arrivals that are late, never early."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.identification.signals.clocks import ClockFit, Unaligned, align, align_all
from slipbench.protocol.recording.channel import Channel

LEAST = 120e-6  # s


def arrivals(seed, n=6000, span=60.0, drift=40e-6, offset=3.25, queued=0.1):
    rng = np.random.default_rng(seed)
    true = np.sort(rng.uniform(0, span, n))
    device = np.round((true * (1 + drift) + offset) / 1e-6) * 1e-6
    late = LEAST + rng.exponential(150e-6, n)
    late += np.where(rng.random(n) < queued, rng.exponential(8e-3, n), 0.0)
    return true, device, true + late


@given(
    seed=st.integers(0, 10_000),
    drift=st.floats(-200e-6, 200e-6),
    offset=st.floats(-1000, 1000),
    queued=st.floats(0, 0.5),
)
@settings(max_examples=60, deadline=None)
def test_drift_and_offset_are_recovered(seed, drift, offset, queued):
    true, device, arrival = arrivals(seed, drift=drift, offset=offset, queued=queued)
    fit = align("ecu", device, arrival)
    assert isinstance(fit, ClockFit)
    assert fit.drift == pytest.approx(drift, abs=1e-6)
    assert np.max(np.abs(fit.to_bus(device) - (true + LEAST))) < 40e-6


def test_queueing_moves_the_latency_figures_not_the_line():
    _, device, calm = arrivals(3, queued=0.0)
    _, _, busy = arrivals(3, queued=0.4)
    quiet, queued = align("ecu", device, calm), align("ecu", device, busy)
    assert isinstance(quiet, ClockFit)
    assert isinstance(queued, ClockFit)
    assert queued.latency_p99 > 5 * quiet.latency_p99
    assert np.ptp(queued.to_bus(device) - quiet.to_bus(device)) < 40e-6


@given(shift=st.floats(-1e4, 1e4))
@settings(max_examples=20, deadline=None)
def test_a_shift_of_the_device_clock_changes_nothing_on_the_bus(shift):
    _, device, arrival = arrivals(5)
    here, there = align("a", device, arrival), align("a", device + shift, arrival)
    assert isinstance(here, ClockFit)
    assert isinstance(there, ClockFit)
    np.testing.assert_allclose(here.to_bus(device), there.to_bus(device + shift), atol=1e-6)


@pytest.mark.parametrize(
    ("damage", "word"),
    [
        (lambda d, a: (d[:10], a[:10]), "samples"),
        (lambda d, a: (d[:60] - d[0], a[:60]), "spans"),
        (lambda d, a: (d + np.where(d > d[3000], 0.5, 0.0), a), "jumps"),
        (lambda d, a: (np.concatenate((d[3000:], d[:3000])), a), "backwards"),
    ],
)
def test_a_clock_that_cannot_be_aligned_is_named_with_the_reason(damage, word):
    _, device, arrival = arrivals(7)
    device, arrival = damage(device, arrival)
    channel = Channel("gear", device, device * 0, "1", "ecu", "test", arrival)
    found = align_all([channel])["ecu"]
    assert isinstance(found, Unaligned)
    assert found.clock == "ecu"
    assert word in found.reason


def test_channels_of_one_clock_are_pooled_and_the_bus_passes_through():
    _, device, arrival = arrivals(9)
    one, two = (
        Channel(r, device[s], device[s] * 0, "1", "ecu", r, arrival[s])
        for r, s in (("gear", slice(0, None, 2)), ("engine_speed", slice(1, None, 2)))
    )
    bus = Channel("trial_phase", arrival, arrival * 0, "1", "bus", "bus")
    found = align_all([one, two, bus])
    assert list(found) == ["ecu"]
    assert found["ecu"].samples == device.size

"""Laws: whichever frames are lost, the teeth that survive have their true counts and times."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from slipbench.protocol.logs.decode import sort_log
from slipbench.protocol.recording.teeth import teeth
from tests.protocol.encoder import ENCODERS
from tests.protocol.logs.test_decode import log_of

SEEDS = st.integers(0, 2**32 - 1)


@st.composite
def rides(draw):
    """Tooth times (us) of a wheel whose speed wanders between walking and 350 km/h."""
    random = np.random.default_rng(draw(SEEDS))
    n = draw(st.integers(10, 1500))
    wander = draw(st.floats(2.5, 6.7)) + np.cumsum(random.normal(0, 0.005, n))
    rates = np.exp(np.clip(wander, 2.4, 6.72))  # teeth per second, 11 to 830
    intervals = np.maximum(1, np.rint(1e6 / rates + random.normal(0, 20, n)))
    return draw(st.integers(0, 2**32 - 1)) + np.cumsum(intervals).astype(np.int64)


@st.composite
def losses(draw):
    """A pattern of losses: scattered, in bursts, or both; a function of the number of frames."""
    random = np.random.default_rng(draw(SEEDS))
    share, bursts = draw(st.sampled_from([0.0, 0.02, 0.3, 0.7])), draw(st.integers(0, 3))

    def lost(n):
        rows = random.random(n) < share
        for start, size in zip(
            random.integers(0, n, bursts), random.integers(1, 120, bursts), strict=True
        ):
            rows[start : start + size] = True
        return rows

    return lost


def received(database, frames):
    """The teeth that a log of these frames tells."""
    log = log_of([(frame.identifier, False, frame.payload) for frame in frames])
    arrival_ns = np.array([frame.arrival for frame in frames], np.int64) * 1000
    by_message = sort_log(log, database).frames
    return teeth(by_message["RearTeeth"], by_message["RearEncoderStatus"], arrival_ns)


def turns(frames, modulo):
    """Whole turns of the count that the first frame which tells it cannot know."""
    anchors = [frame.count for frame in frames if frame.anchor]
    counts = [frame.count for frame in frames if not frame.anchor]
    return anchors[0] // 8192 * 8192 if anchors else counts[0] // modulo * modulo


@pytest.mark.parametrize("bus", ENCODERS)
@settings(max_examples=40, deadline=None)
@given(times=rides(), first=st.integers(0, 100_000))
def test_every_tooth_is_told_once_and_exactly_when_nothing_is_lost(bus, times, first):
    frames = ENCODERS[bus].frames(times, first)
    result = received(ENCODERS[bus].database, frames)
    count = result.count + turns(frames, ENCODERS[bus].modulo) - first
    assert (count == np.arange(count.size)).all()
    assert count.size > times.size - 11
    assert result.anchored.all()
    assert ((result.time_us - times[count]) % 2**32 == 0).all()
    assert (np.diff(result.time_us) == np.diff(times[count])).all()


@pytest.mark.parametrize("bus", ENCODERS)
@settings(max_examples=150, deadline=None)
@given(times=rides(), lost=losses())
def test_any_loss_leaves_true_counts_and_true_times(bus, times, lost):
    frames = ENCODERS[bus].frames(times)
    kept = [each for each, gone in zip(frames, lost(len(frames)), strict=True) if not gone]
    assume(any(not frame.anchor for frame in kept))
    result = received(ENCODERS[bus].database, kept)
    count = result.count + turns(kept, ENCODERS[bus].modulo)
    told = {frame.count for frame in kept if not frame.anchor}
    assert told <= set(count.tolist())
    assert (np.diff(count) > 0).all()
    truth = times[count]
    assert ((result.time_us - truth)[result.anchored] % 2**32 == 0).all()
    joined = np.diff(count) == 1
    assert (np.diff(result.time_us)[joined] == np.diff(truth)[joined]).all()
    assert (np.diff(result.time_us) > 0).all()
    assert (result.arrival_ns >= truth * 1000).all()


@pytest.mark.parametrize("bus", ENCODERS)
@settings(max_examples=60, deadline=None)
@given(times=rides(), lost=losses())
def test_without_anchors_times_are_laid_by_arrival_and_say_so(bus, times, lost):
    frames = [frame for frame in ENCODERS[bus].frames(times) if not frame.anchor]
    kept = [each for each, gone in zip(frames, lost(len(frames)), strict=True) if not gone]
    assume(kept)
    result = received(ENCODERS[bus].database, kept)
    assert not result.anchored.any()
    inside = np.diff(result.arrival_ns) == 0
    count = result.count + turns(kept, ENCODERS[bus].modulo)
    assert (np.diff(result.time_us)[inside] == np.diff(times[count])[inside]).all()
    assert (np.abs(result.time_us - times[count]) < 20_000).all()

"""Teeth keep their intervals, and never lie in the future."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.bench.gateway.tooth_stream import ToothStream
from slipbench.protocol.codec.messages import Intervals, ToothIntervals

MODULO = 256


def frames(intervals, per_frame=3, start=250):
    """Frames of so many intervals, and when each was complete."""
    times = np.cumsum(intervals)
    made = []
    for i in range(0, len(intervals) - per_frame + 1, per_frame):
        part = tuple(float(x) for x in intervals[i : i + per_frame])
        count = (start + i + per_frame) % MODULO
        made.append((times[i + per_frame - 1], ToothIntervals(Intervals.SHORT, count, part)))
    return made


@given(
    st.lists(st.floats(1e-3, 9e-3), min_size=6, max_size=60),
    st.lists(st.floats(0.0, 2e-3), min_size=30, max_size=30),
)
def test_intervals_are_kept_and_no_tooth_comes_after_its_frame(intervals, transit):
    stream, found = ToothStream(MODULO), []
    for k, (complete, frame) in enumerate(frames(intervals)):
        now = complete + 0.0001 + transit[k % 30]
        teeth = stream.take(frame, now)
        assert all(time <= now + 1e-9 for time, _ in teeth)
        np.testing.assert_allclose(np.diff([t for t, _ in teeth]), frame.intervals[1:], atol=1e-12)
        found += teeth
    counts = np.array([c for _, c in found])
    assert np.all(np.diff(counts) == 1)


def test_lost_frames_are_a_step_of_the_count_and_time_goes_on():
    stream, intervals = ToothStream(MODULO), [0.0025] * 90
    made = frames(intervals)
    teeth = [stream.take(frame, complete + 2e-4) for complete, frame in made[:10]]
    after = [stream.take(frame, complete + 2e-4) for complete, frame in made[14:20]]
    last, first = teeth[-1][-1], after[0][0]
    assert first[1] - last[1] == 13
    assert first[0] - last[0] == pytest.approx(13 * 0.0025, abs=1e-9)


@pytest.mark.parametrize("start", [0, 100, 253])
def test_a_running_count_begins_as_the_first_frame_counts_and_goes_on_without_a_wrap(start):
    stream = ToothStream(MODULO)
    for k, (complete, frame) in enumerate(frames([0.0025] * 300, start=start)):
        offset = 0 if start + 3 < MODULO else MODULO  # what the first frame's count has wrapped by
        expected = [start - offset + 3 * k + n for n in (1, 2, 3)]
        assert [count for _, count in stream.take(frame, complete)] == expected


@pytest.mark.parametrize("late", [0.0, 0.004])
def test_after_lost_teeth_time_goes_on_from_the_arrival_of_the_next_frame(late):
    """How long the lost ones took is not known: no delay of before is believed."""
    stream = ToothStream(MODULO)
    made = frames([0.0025] * 90)
    for complete, frame in made[:10]:
        stream.take(frame, complete + 2e-4)
    complete, frame = made[14]
    now = complete + 2e-4 + late
    teeth = stream.take(frame, now)
    assert [time for time, _ in teeth] == pytest.approx([now - 0.005, now - 0.0025, now])
    complete, frame = made[15]
    assert stream.take(frame, complete + 2e-4)[-1][0] == pytest.approx(complete + 2e-4, abs=1e-9)


def test_a_late_frame_does_not_make_the_next_one_late():
    stream = ToothStream(MODULO)
    made = frames([0.0025] * 300)
    told = []
    for k, (complete, frame) in enumerate(made):
        now = complete + (0.002 if k == 50 else 0.0002)
        told.append(stream.take(frame, now)[-1][0] - complete)
    assert max(told) < 3e-4


def test_a_standing_frame_tells_no_tooth():
    assert ToothStream(MODULO).take(ToothIntervals(Intervals.STANDING, 3, (0.5,)), 1.0) == []

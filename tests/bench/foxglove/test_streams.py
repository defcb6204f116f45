"""Laws of a live stream: it waits for clients, skips nothing, and says when it is late."""

import shutil

import pytest

from slipbench.bench.foxglove.streams import LAGS, NOTHING_SKIPPED, SETTLING, LiveStream, run_stream
from slipbench.bench.view.live_run import LiveView
from tests.bench.foxglove.conftest import decoded
from tests.bench.foxglove.wire import Wire


class HandClock:
    """A clock that a test sets."""

    now = 0

    def now_ns(self):
        return self.now

    def sleep_until_ns(self, deadline):
        self.now = deadline


@pytest.fixture
def stream_of():
    """A stream of a folder, its server and its clock."""

    def make(root):
        wire, clock = Wire(), HandClock()
        return LiveStream(wire, LiveView(root, clock, NOTHING_SKIPPED), clock), wire, clock

    return make


def sent_by_topic(wire):
    found = {}
    for time, topic, _ in wire.sent:
        found.setdefault(topic, []).append(time)
    return found


def test_frames_wait_until_clients_can_subscribe_and_all_are_sent(run, stream_of):
    stream, wire, clock = stream_of(run)
    stream.step()
    assert (len(wire.schemas) > 10, wire.sent, stream.complete) == (True, [], False)
    clock.now = SETTLING - 1
    stream.step()
    assert wire.sent == []
    clock.now = SETTLING
    while not stream.complete:
        stream.step()
    sent = sent_by_topic(wire)
    for topic, values in decoded(run).items():
        assert sent[topic] == [time for time, _ in values]


def test_clients_are_warned_for_as_long_as_the_stream_lags(run, stream_of):
    size = (run / "frames.log").stat().st_size
    assert size > 1_000_000, "a look must not read the whole recording"
    stream, wire, clock = stream_of(run)
    stream.step()
    clock.now = SETTLING
    stream.step()
    assert wire.warnings == [LAGS]
    while not stream.complete:
        stream.step()
    assert wire.warnings == []


def test_before_a_run_there_is_nothing_and_it_is_found_when_it_comes(run, stream_of, tmp_path):
    stream, wire, _ = stream_of(tmp_path / "later")
    for _ in range(12):
        stream.step()
    assert (wire.schemas, stream.complete) == ({}, True)
    shutil.copytree(run, tmp_path / "later")
    for _ in range(12):
        stream.step()
    assert len(wire.schemas) > 10


def test_what_cannot_be_read_is_said_once_and_the_stream_goes_on():
    said, steps = [], []

    def step():
        steps.append(1)
        raise ValueError("a bad line")

    run_stream(step, said.append, HandClock(), lambda _seconds: len(steps) >= 5)
    assert len(steps) == 5
    assert said == ["the stream cannot read: a bad line"]

"""A replay is never early and never out of order, however it is controlled while it runs."""

import multiprocessing
import os
import signal
import threading

import can
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.bench.bus.opening import BusAddress, open_bus
from slipbench.bench.commands import _watch
from slipbench.bench.loop.clock import MILLISECOND, SECOND, SimulatedClock
from slipbench.bench.replay.replay import NOT_SENT, replay
from slipbench.bench.replay.replay_controls import Controls
from slipbench.bench.replay.replay_keys import steer
from slipbench.bench.replay.replay_process import Ready, ReplayOrder, Report, running_replay
from slipbench.bench.replay.replay_report import position, summary, timing
from slipbench.bench.replay.replay_selection import (
    channels_by_bus,
    select_buses,
    select_identifiers,
)
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.frame_log import FrameLog
from tests.recordings import recording


def log_of(times_ms, identifiers) -> FrameLog:
    n = len(identifiers)
    return FrameLog(
        np.array(times_ms, np.int64) * 1_000_000,
        np.arange(n, dtype=np.uint8) % 2,
        np.array(identifiers, np.uint32),
        np.zeros(n, bool),
        np.zeros(n, bool),
        np.zeros(n, bool),
        np.full(n, 2, np.uint8),
        np.tile(np.arange(8, dtype=np.uint8), (n, 1)) * (np.arange(8) < 2),
        ("can0", "can1"),
    )


class Listening(can.BusABC):
    """A bus that stores frames and their times, on a simulated clock. It imitates no wire."""

    def __init__(self, clock, into=None, name="listening"):
        self.clock, self.sent = clock, [] if into is None else into
        self.channel_info = self.name = name
        super().__init__(channel=name)

    def send(self, msg, timeout=None):
        self.sent.append((self.clock.now_ns(), msg.arbitration_id, bytes(msg.data)))


def played(log, controls=None, clock=None):
    """Frames on a bus, (ns, identifier, data), and the result of the replay of `log`."""
    clock = clock or SimulatedClock()
    with Listening(clock) as bus:
        done = replay(log, [bus] * len(log.buses), clock, controls or Controls.local())
    return bus.sent, done


frames = st.lists(
    st.tuples(st.integers(0, 50), st.integers(0, 0x7FF)), min_size=1, max_size=50
).map(lambda drawn: sorted(drawn, key=lambda frame: frame[0]))
speeds = st.sampled_from([0.5, 1.0, 3.0, 4.0])


@given(frames, speeds)
@settings(deadline=None)
def test_order_is_kept_nothing_is_early_first_and_last_are_there(drawn, speed):
    log = log_of([t for t, _ in drawn], [i for _, i in drawn])
    sent, done = played(log, Controls.local(speed))
    assert [identifier for _, identifier, _ in sent] == log.identifier.tolist()
    due = SECOND + (log.time_ns - log.time_ns[0]) / speed
    times = np.array([t for t, _, _ in sent])
    assert np.all(times >= due)
    assert np.all(times < due + 1)
    assert np.all(done.lateness == 0)
    assert (done.sent, done.passes) == (len(log), 1)


@given(frames, st.integers(2, 4), speeds)
@settings(deadline=None)
def test_every_pass_is_the_log_again_and_none_is_early(drawn, passes, speed):
    log = log_of([t for t, _ in drawn], [i for _, i in drawn])
    sent, done = played(log, Controls.local(speed, passes))
    assert [identifier for _, identifier, _ in sent] == log.identifier.tolist() * passes
    assert (done.sent, done.passes) == (passes * len(log), passes)
    offsets = (log.time_ns - log.time_ns[0]) / speed
    times = np.array([t for t, _, _ in sent]).reshape(passes, -1)
    assert np.all(np.diff(times[:, 0]) > offsets[-1])
    assert np.all(times - times[:, :1] >= offsets - 1)


class Steering:
    """A simulated clock that changes the controls at given times."""

    def __init__(self, controls, actions):
        self.controls, self.actions = controls, sorted(actions, key=lambda action: action[0])
        self.clock = SimulatedClock(world=self.act)

    def act(self, until):
        while self.actions and SECOND + self.actions[0][0] * MILLISECOND <= until:
            self.actions.pop(0)[1](self.controls)

    def now_ns(self):
        return self.clock.now_ns()

    def sleep_until_ns(self, deadline):
        self.clock.sleep_until_ns(deadline)


def steered(times_ms, *actions, passes=1):
    controls = Controls.local(1.0, passes)
    clock = Steering(controls, actions)
    log = log_of(times_ms, range(len(times_ms)))
    sent, done = played(log, controls, clock)
    return [((t - SECOND) / MILLISECOND, identifier) for t, identifier, _ in sent], done


def test_a_pause_moves_everything_after_it_and_loses_nothing():
    sent, done = steered([0, 100, 200, 300], (150, Controls.pause), (1150, Controls.resume))
    assert [identifier for _, identifier in sent] == [0, 1, 2, 3]
    assert [t for t, _ in sent[:2]] == [0, 100]
    assert 1200 <= sent[2][0] <= 1240  # noticed within LONGEST_WAIT at either end
    assert sent[3][0] - sent[2][0] == pytest.approx(100)
    assert done.sent == 4


def test_a_seek_goes_on_with_the_first_frame_there_forwards_and_back():
    sent, done = steered(
        [0, 100, 200, 300, 400],
        (50, lambda controls: controls.seek(250 * MILLISECOND)),
        (150, lambda controls: controls.seek(200 * MILLISECOND)),
    )
    assert [identifier for _, identifier in sent] == [0, 3, 2, 3, 4]
    assert done.lateness[1] == NOT_SENT


def test_another_speed_holds_from_where_it_was_asked_for():
    sent, done = steered([0, 1000, 2000], (1000, lambda controls: controls.set_speed(2.0)))
    assert sent[2][0] == pytest.approx(1500, abs=25)
    (begin, first), (place, second) = done.speeds
    assert (begin, first, second) == (0, 1.0, 2.0)
    assert place == pytest.approx(1000 * MILLISECOND, abs=25 * MILLISECOND)


@given(st.lists(st.tuples(st.integers(1, 1900), st.sampled_from([0.5, 1.0, 2.0])), max_size=5))
@settings(deadline=None)
def test_the_report_states_the_speeds_that_applied(changes):
    """The time of the last frame follows from the speeds and their positions alone."""
    actions = [(t, lambda controls, s=s: controls.set_speed(s)) for t, s in changes]
    sent, done = steered([0, 1000, 2000], *actions)
    places = [place for place, _ in done.speeds] + [2000 * MILLISECOND]
    took = sum(
        (end - begin) / speed
        for begin, end, (_, speed) in zip(places, places[1:], done.speeds, strict=False)
    )
    assert sent[-1][0] == pytest.approx(took / MILLISECOND, abs=0.1)
    ready = Ready(3, 2000 * MILLISECOND, {}, ())
    table = timing(ready, Report(done, int(took), ()))
    text = summary(table)
    assert f"speed {done.speeds[0][1]:g}" in text
    assert text.count("s on ") == len(done.speeds) - 1


@given(st.integers(0, 100))
def test_a_replay_that_starts_later_begins_with_the_first_frame_there(start):
    controls = Controls.local()
    controls.seek(start * MILLISECOND)
    sent, done = played(log_of(range(0, 101, 10), range(11)), controls)
    assert [identifier for _, identifier, _ in sent] == [n for n in range(11) if n * 10 >= start]
    assert done.sent == len(sent)


def test_the_line_of_a_replay_shows_position_speed_and_pause():
    controls = Controls.local(2.0)
    controls.report_progress(7, 7, 1500 * MILLISECOND)
    assert position(controls, 60 * SECOND) == "1.5 s of 60.0 s, speed 2"
    controls.set_speed(0.5)
    controls.pause()
    assert position(controls, 60 * SECOND) == "1.5 s of 60.0 s, speed 0.5, paused"


def test_an_endless_replay_ends_when_it_is_stopped():
    sent, done = steered([0, 10, 20], (1000, Controls.stop), passes=0)
    assert 90 <= done.sent == len(sent) <= 102
    assert sent[-1][0] <= 1020


def test_keys_control_the_replay():
    controls = Controls.local()
    controls.report_progress(5, 5, 30 * SECOND)
    steer(controls, " ")
    assert controls.paused
    steer(controls, " ")
    assert not controls.paused
    steer(controls, "\x1b[C")
    assert controls.take_seek() == 40 * SECOND
    steer(controls, "\x1b[D")
    assert controls.take_seek() == 20 * SECOND
    steer(controls, "+")
    assert controls.speed == 2.0
    steer(controls, "q")
    assert controls.stopped


def test_each_bus_of_the_log_goes_onto_its_own_in_one_order():
    log, clock, heard = log_of(range(20), range(20)), SimulatedClock(), []
    with Listening(clock, [], "a") as first, Listening(clock, [], "b") as second:
        first.sent = second.sent = heard
        replay(log, [first, second], clock, Controls.local())
    assert [identifier for _, identifier, _ in heard] == list(range(20))
    with Listening(clock) as first, Listening(clock) as second:
        replay(log, [first, second], clock, Controls.local())
    assert [identifier for _, identifier, _ in first.sent] == list(range(0, 20, 2))
    assert [identifier for _, identifier, _ in second.sent] == list(range(1, 20, 2))


def test_buses_and_identifiers_are_selected():
    log = log_of(range(4), [0x10, 0x20, 0x250, 0x7FF])
    assert select_buses(log, ["can1"], "x.log").identifier.tolist() == [0x20, 0x7FF]
    both = select_buses(log, ["can1", "can0"], "x.log")
    assert (both.buses, both.bus.tolist()) == (("can1", "can0"), [1, 0, 1, 0])
    assert select_identifiers(log, "0x10,0x200-0x2FF", "").identifier.tolist() == [0x10, 0x250]
    assert select_identifiers(log, "", "0x7FF").identifier.tolist() == [0x10, 0x20, 0x250]
    assert channels_by_bus(["can1=vcan3"], log) == {"can1": "vcan3"}
    assert channels_by_bus(["vcan3"], log) == {"can0": "vcan3", "can1": "vcan3"}


@pytest.mark.parametrize(
    ("action", "words"),
    [
        (lambda log: select_buses(log, ["can7"], "x.log"), "no bus 'can7'"),
        (lambda log: select_identifiers(log, "0xZZ", ""), "not an identifier"),
        (lambda log: select_identifiers(log, "", "1-0x3FFFFFFFF"), "not an identifier"),
        (lambda log: channels_by_bus(["can7=vcan0"], log), "BUS=CHANNEL"),
        (lambda log: channels_by_bus(["a", "b"], log), "BUS=CHANNEL"),
    ],
)
def test_an_invalid_selection_is_rejected(action, words):
    with pytest.raises(InputError, match=words):
        action(log_of([0], [1]))


def test_a_bus_that_refuses_once_gets_the_frame_at_the_second_try():
    class Reluctant(Listening):
        tries = 0

        def send(self, msg, timeout=None):
            self.tries += 1
            if self.tries % 3 == 1:
                raise can.CanOperationError("no buffer space")
            super().send(msg)

    log, clock = log_of(range(9), range(9)), SimulatedClock()
    with Reluctant(clock) as bus:
        done = replay(log, [bus, bus], clock, Controls.local())
    assert [identifier for _, identifier, _ in bus.sent] == list(range(9))
    assert done.refused > 0


def test_an_independent_listener_gets_every_frame_of_a_real_drive_in_order():
    log = read_log(recording("subaru_wrx/can_sample.log")).frames
    address, heard, over = BusAddress("virtual", "replay"), [], threading.Event()
    with can.Bus(interface="virtual", channel="replay") as listener:

        def listen():
            while not over.is_set():
                while (message := listener.recv(0.05)) is not None:
                    heard.append((message.arbitration_id, bytes(message.data)))

        thread = threading.Thread(target=listen)
        thread.start()
        with open_bus(address, receive_own_messages=False) as bus:
            replay(log, [bus] * len(log.buses), SimulatedClock(), Controls.local())
        over.set()
        thread.join()
    sent = [
        (int(i), d[:n].tobytes())
        for i, d, n in zip(log.identifier, log.data, log.length, strict=True)
    ]
    assert len(heard) == 82_558
    assert heard == sent


def test_the_real_time_process_replays_and_reports(tmp_path):
    lines = [f"(1.{n:03d}000) can{n % 2} 12{n % 8}#0{n % 8}\n" for n in range(300)]
    (tmp_path / "x.log").write_text("".join(lines))
    order = ReplayOrder(tmp_path / "x.log", "virtual", ("a",), without="0x127")
    with running_replay(order, speed=2.0, passes=1) as running:
        assert running.ready.frames == 263
        assert running.ready.buses == {"can0": "a", "can1": "a"}
        running.begin()
        report = running.report(within=20.0)
    assert report is not None
    assert report.replayed.sent == 263
    assert np.all(report.replayed.lateness >= 0)
    assert report.took >= 149 * MILLISECOND
    table = timing(running.ready, report)
    assert table["speeds"] == [{"from": 0.0, "speed": 2.0}]
    assert table["lateness"]["p50"] <= table["lateness"]["max"]
    assert "263 frames replayed" in summary(table)


def test_a_log_or_a_bus_that_cannot_be_used_is_reported_before_any_frame_is_sent(tmp_path):
    order = ReplayOrder(tmp_path / "none.log", "virtual", ("a",))
    with pytest.raises(InputError, match="no such file"), running_replay(order, 1.0, 1):
        pass


@pytest.fixture
def endless(tmp_path):
    """A replay without an end in a separate process, and the number of that process."""
    (tmp_path / "x.log").write_text("(1.000000) can0 123#00\n(1.010000) can0 123#01\n")
    order = ReplayOrder(tmp_path / "x.log", "virtual", ("a",))
    with running_replay(order, speed=1.0, passes=0) as running:
        [process] = [each for each in multiprocessing.active_children() if each.name == "replay"]
        yield running, process.pid


def test_a_replay_whose_process_dies_is_reported(endless):
    running, number = endless
    running.begin()
    os.kill(number, signal.SIGKILL)
    with pytest.raises(InputError, match="replay process died\n  found: signal 9"):
        running.report(within=20.0)


def test_a_replay_that_was_stopped_does_not_keep_the_command_from_ending(endless, monkeypatch):
    """Ctrl-C reaches the command, and the replay cannot respond any more."""
    monkeypatch.setattr("slipbench.bench.replay.replay_process.END_TIMEOUT", 0.5)
    running, number = endless
    os.kill(number, signal.SIGSTOP)
    threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(InputError, match="did not end when asked to"):
        _watch(running, "x.log")


def test_frames_of_one_moment_keep_their_order_on_a_bus_that_arbitrates(tmp_path):
    """All due at once, the most urgent last: another process receives them in the order of the log."""
    identifiers = [0x7FF - n for n in range(300)]
    lines = [f"(1.000000) can0 {identifier:03X}#00\n" for identifier in identifiers]
    (tmp_path / "x.log").write_text("".join(lines))
    channel = f"{tmp_path.name}-{os.getpid()}"
    with can.Bus(interface="slipbench", channel=channel, bitrate=1_000_000) as listener:
        order = ReplayOrder(tmp_path / "x.log", "slipbench", (channel,))
        with running_replay(order, speed=1.0, passes=1) as running:
            running.begin()
            heard = [listener.recv(20.0).arbitration_id for _ in identifiers]
            report = running.report(within=20.0)
    assert heard == identifiers
    assert report is not None
    assert report.replayed.sent == 300

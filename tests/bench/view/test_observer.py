"""Laws of the view's state: it is that of the gateway, whatever the pieces in which frames are read."""

import math
import re
import shutil
from itertools import pairwise

import pytest
import tomli_w

from slipbench.bench.session.rider_line import ArmingWatch
from slipbench.bench.trials.preparation import prepare
from slipbench.bench.view.limits import AtButton, used_limits
from slipbench.bench.view.log_tail import LogTail
from slipbench.bench.view.observer import SAMPLED, TrialObserver
from slipbench.bench.view.recorded_trial import recorded_trial
from slipbench.bench.view.replay_run import ReplayRun
from slipbench.bench.view.tick_watch import TickWatch
from slipbench.bench.view.timed_lines import TimedLines, frame_time
from slipbench.protocol.codec.messages import Phase
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.run_folder import read
from tests.bench.view.recordings import recorded, short_trial


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("view"))


def observed_in_pieces(run, piece):
    observer, lines = TrialObserver(recorded_trial(run)), (run / "frames.log").read_bytes()
    lines = lines.splitlines(keepends=True)
    for begin in range(0, len(lines), piece):
        observer.observe(b"".join(lines[begin : begin + piece]))
    return observer


def test_the_state_does_not_depend_on_the_pieces_that_are_read(run):
    one, many = observed_in_pieces(run, 10**9), observed_in_pieces(run, 97)
    assert repr(one.samples()) == repr(many.samples())
    first, second = one.observed(), many.observed()
    assert (first.phase, first.limits, first.faults, first.frames) == (
        second.phase,
        second.limits,
        second.faults,
        second.frames,
    )
    assert second.bus_load == pytest.approx(first.bus_load)
    assert first.bus_load["can0"] == pytest.approx(read(run).bus_load["can0"]["mean"], rel=0.05)


def test_the_samples_are_the_recorded_channels(run):
    samples = observed_in_pieces(run, 1000).samples()
    recording = read(run)
    start = recording.start_time_ns * 1e-9
    speed = recording.channels["optical_speed"]
    throttle = recording.channels["throttle_position"]
    for sample in samples[20::50]:
        row = dict(zip(SAMPLED, sample, strict=True))
        assert row["speed"] in speed.value[abs(speed.time - (row["time"] - start)) < 0.05]
        near = throttle.value[abs(throttle.time - (row["time"] - start)) < 0.01]
        assert near.min() <= row["throttle"] <= near.max()


def test_the_phase_is_that_of_the_outcome(run):
    observer = TrialObserver(recorded_trial(run))
    lines = TimedLines(run / "frames.log", frame_time)
    phases = load_toml(run / "run.toml")["outcome"]["phases"]
    for phase, following in pairwise(phases):
        observer.observe(lines.until(following["time_ns"] - 1_000_000))
        assert observer.observed().phase == Phase[phase["phase"].upper()]
    observer.observe(lines.until(10**18))
    assert observer.observed().phase == Phase.DONE
    lines.close()


def test_what_is_missing_to_arm_is_what_the_session_says(run, tmp_path):
    watch = ArmingWatch(prepare(short_trial(tmp_path)), run, ("can0",))
    observer = TrialObserver(recorded_trial(run))
    first = b"".join((run / "frames.log").read_bytes().splitlines(keepends=True)[:20])
    half = tmp_path / "half"
    half.mkdir()
    (half / "frames.log").write_bytes(first)
    watch = ArmingWatch(prepare(short_trial(tmp_path)), half, ("can0",))
    observer.observe(first)
    assert observer.observed().not_armed == watch.reason() != ""


def test_a_trial_trips_where_a_limit_is_wholly_used(tmp_path):
    run = recorded(tmp_path, limits={"distance": "60 m"})
    outcome = load_toml(run / "run.toml")["outcome"]
    assert outcome["trip"] == "distance"
    observer = observed_in_pieces(run, 500)
    seen = observer.observed()
    assert seen.phase == Phase.TRIPPED
    assert seen.trip.name == "DISTANCE"
    assert seen.limits["distance"] >= 1.0


def test_a_limit_is_used_by_as_much_as_the_way_to_it(run):
    recorded_as = recorded_trial(run)
    seen = observed_in_pieces(run, 10**9).observed()
    limits = recorded_as.plan.trial.limits
    begun = AtButton(0.1, 0.1, seen.vehicle.engine.engine_speed, seen.vehicle.speed)
    shares = used_limits(seen.vehicle, seen.command, begun, limits)
    assert shares["engine_speed"] == shares["speed"] == 0.0
    assert shares["slip"] == abs(seen.vehicle.slip) / limits.slip
    low = used_limits(seen.vehicle, seen.command, AtButton(0.1, 0.1, math.nan, math.nan), limits)[
        "speed"
    ]
    middle = sum(limits.speed) / 2
    assert low == pytest.approx(abs(seen.vehicle.speed - middle) / (limits.speed[1] - middle))


def test_a_tail_gives_each_whole_line_once(tmp_path):
    path, lines = tmp_path / "log", [b"%d\n" % number for number in range(1000)]
    tail, text, found = LogTail(path), b"".join(lines), b""
    assert tail.read() == b""
    with path.open("ab", buffering=0) as file:
        for begin in range(0, len(text), 37):
            file.write(text[begin : begin + 37])
            read = tail.read()
            assert not read or read.endswith(b"\n")
            found += read
    assert found == text
    assert tail.skipped == 0


@pytest.mark.parametrize("most", range(100, 107))
def test_a_tail_that_falls_behind_skips_to_the_newest_whole_lines(tmp_path, most):
    path = tmp_path / "log"
    path.write_bytes(b"".join(b"%06d\n" % number for number in range(1000)))
    tail = LogTail(path, most)
    found = tail.read().splitlines()
    assert found == [b"%06d" % number for number in range(1000 - len(found), 1000)]
    assert len(found) in (most // 7, most // 7 - 1)
    assert tail.skipped == 7000 - most
    with path.open("ab") as file:
        file.write(b"001000\n")
    assert tail.read() == b"001000\n"


def test_a_seek_finds_the_first_line_of_a_time(run):
    lines = (run / "frames.log").read_bytes().splitlines(keepends=True)
    times = [frame_time(line) for line in lines]
    reader = TimedLines(run / "frames.log", frame_time)
    assert reader.bounds() == (times[0], times[-1])
    for time in (0, times[0], times[1], times[5000] + 1, times[-1], times[-1] + 1):
        reader.seek(time)
        expected = b"".join(line for line, at in zip(lines, times, strict=True) if at >= time)
        assert reader.until(10**18) == expected
    reader.close()


class HandClock:
    """A clock that a test sets."""

    def __init__(self):
        self.now = 0

    def now_ns(self):
        return self.now

    def sleep_until_ns(self, deadline):
        self.now = deadline


def test_a_seek_gives_the_state_that_playing_gives(run):
    clock = HandClock()
    played, sought = ReplayRun(run, clock), ReplayRun(run, clock)
    for tenth in range(35):
        clock.now = tenth * 100_000_000
        expected = played.update()
    sought.control({"play": False})
    sought.control({"seek": clock.now * 1e-9})
    found = sought.update()
    assert expected["phase"] == "exciting"
    assert found["distance_left"] == pytest.approx(expected["distance_left"], abs=0.5)
    assert found["limits"] == pytest.approx(expected["limits"], rel=0.01)
    played.close()
    sought.close()


def test_the_slip_shown_is_that_of_a_turn_of_the_wheel(run):
    """The demonstration's encoder has tooth-pitch errors of several per cent of a tooth."""
    rows = [dict(zip(SAMPLED, row, strict=True)) for row in observed_in_pieces(run, 999).samples()]
    after = [row for row in rows if row["time"] > rows[-1]["time"] - 0.3]
    assert max(abs(row["slip"] - after[0]["slip"]) for row in after) < 0.004


def test_without_a_status_of_the_trial_authority_tells_the_phase(run, tmp_path):
    bare = tmp_path / "run"
    shutil.copytree(run, bare)
    text = (bare / "database.dbc").read_text()
    number = re.search(r"BO_ (\d+) TrialStatus", text)[1]
    text = re.sub(rf"BO_ {number} TrialStatus.*?\n\n", "", text, flags=re.DOTALL)
    text = re.sub(rf"(CM_|BA_|VAL_)[^;]* {number} [^;]*;\n", "", text)
    (bare / "database.dbc").write_text(text)
    roles = load_toml(bare / "roles.toml")
    for name in [each for each, role in roles["roles"].items() if "TrialStatus" in str(role)]:
        del roles["roles"][name]
    (bare / "roles.toml").write_text(tomli_w.dumps(roles))
    observer, lines = (
        TrialObserver(recorded_trial(bare)),
        TimedLines(bare / "frames.log", frame_time),
    )
    exciting, settling = (
        each["time_ns"] for each in load_toml(run / "run.toml")["outcome"]["phases"][1:3]
    )
    observer.observe(lines.until(exciting - 10_000_000))
    assert observer.observed().phase == Phase.IDLE
    observer.observe(lines.until(settling))
    seen = observer.observed()
    assert seen.phase == Phase.EXCITING
    assert seen.limits["distance"] > 0.0
    observer.observe(lines.until(10**18))
    assert observer.observed().phase == Phase.IDLE
    lines.close()


def test_frames_that_were_not_read_make_the_button_unknown(run):
    observer = TrialObserver(recorded_trial(run))
    lines = TimedLines(run / "frames.log", frame_time)
    exciting = load_toml(run / "run.toml")["outcome"]["phases"][1]["time_ns"]
    observer.observe(lines.until(exciting - 500_000_000))
    lines.seek(exciting + 1_000_000_000)
    observer.skipped()
    observer.observe(lines.until(exciting + 1_500_000_000))
    seen = observer.observed()
    assert seen.phase == Phase.EXCITING
    assert "distance" not in seen.limits
    lines.close()


def test_a_replay_has_its_own_clock_with_pause_and_seek(run):
    clock = HandClock()
    replay = ReplayRun(run, clock)
    clock.now = 1_000_000_000
    assert replay.update()["time"] == pytest.approx(1.0, abs=0.01)
    replay.control({"play": False})
    clock.now = 3_000_000_000
    assert replay.update()["position"] == 1.0
    assert replay.control({"seek": 2.5}) is True
    state = replay.update()
    assert (state["position"], state["playing"]) == (2.5, False)
    assert state["time"] == pytest.approx(2.5, abs=0.01)
    replay.control({"play": True})
    clock.now += 100_000_000
    assert replay.update()["position"] == pytest.approx(2.6)
    replay.control({"seek": 1e9})
    state = replay.update()
    assert (state["phase"], state["playing"]) == ("done", False)
    assert state["outcome"]["phase"] == "done"
    replay.close()


@pytest.mark.parametrize("wish", [{}, {"seek": "1"}, {"seek": None}, {"seek": True}, {"stop": 1}])
def test_a_replay_ignores_what_it_does_not_know(run, wish):
    replay = ReplayRun(run, HandClock())
    assert replay.control(wish) is False
    assert replay.position == 0
    replay.close()


def test_the_lateness_is_that_of_the_table(run):
    watch = TickWatch()
    watch.observe((run / "ticks.csv").read_bytes())
    watch.observe(b"9000,1,2500000,late\n9001,2,,skipped\n")
    figures = watch.figures()
    ran = load_toml(run / "run.toml")["lateness"]["ran"]
    assert figures["ticks"] == ran + 2
    assert (figures["worst"], figures["late"], figures["skipped"]) == (2.5, 1, 1)


def test_a_folder_without_a_trial_is_refused(tmp_path):
    with pytest.raises(InputError, match="not the run folder of a trial"):
        recorded_trial(tmp_path)


def test_a_tail_that_may_lag_gives_every_line_in_parts(tmp_path):
    path, text = tmp_path / "log", b"".join(b"%06d\n" % number for number in range(1000))
    path.write_bytes(text)
    tail, found = LogTail(path, most=100, lag=math.inf), b""
    while tail.behind:
        found += tail.read()
    assert (found, tail.skipped) == (text, 0)


@pytest.mark.parametrize("speed", [0.5, 3.0])
def test_the_speed_of_a_replay_holds_from_when_it_is_set(run, speed):
    clock = HandClock()
    replay = ReplayRun(run, clock)
    clock.now = 1_000_000_000
    replay.control({"speed": speed})
    clock.now = 2_000_000_000
    assert replay.position == pytest.approx(1e9 * (1 + speed))
    for wrong in (0.0, -1.0, math.nan, math.inf, True, "2"):
        replay.control({"speed": wrong})
        assert replay.speed == speed
    replay.close()

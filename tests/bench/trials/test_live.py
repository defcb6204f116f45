"""In real time: functional laws only, for nothing here may depend on how fast a machine is."""

import errno
import multiprocessing
import os
import resource
import signal
import threading
import time

import numpy as np
import pytest

from slipbench.bench.bus.opening import BusAddress, open_bus
from slipbench.bench.loop.realtime_process import NO_SPIN
from slipbench.bench.loop.ticks import read_ticks
from slipbench.bench.trials.live_trial import _opened
from slipbench.bench.trials.progress import script_duration
from slipbench.bench.trials.run import end_run, run_trial
from slipbench.bench.vehicle.live_vehicle import vehicle_process
from slipbench.protocol.codec.messages import Phase, TripReason
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import read_log
from slipbench.protocol.recording.run_folder import read
from tests.bench.trials.test_whole_trial import prepared


def ridden(the_trial, folder, told=lambda _: None, progress=lambda _: None):
    """A trial on a virtual bus, with the virtual motorcycle in a process of its own."""
    address = BusAddress("slipbench", f"{folder.parent.name}-{os.getpid()}")
    with vehicle_process(the_trial.scenario, the_trial.binding, [address]) as vehicle:
        return run_trial(the_trial, folder, [address], progress, told, vehicle)


def test_a_trial_in_real_time_is_recorded_whole(tmp_path):
    """On a machine that stalls it may trip, which is right; what it recorded must be whole."""
    phases: list[Phase] = []
    shown: list[float] = []
    the_trial = prepared(excitation__duration="1 s")
    outcome = ridden(the_trial, tmp_path / "run", phases.append, shown.append)
    assert shown == sorted(shown)
    assert shown[-1] == script_duration(the_trial.trial)
    recording_ = read(tmp_path / "run")
    sent = read_log(tmp_path / "run" / "frames.log").frames
    commands = int(np.sum((sent.identifier == 0x10) & sent.sent))
    ticks = read_ticks(tmp_path / "run" / "ticks.csv", outcome.lateness.period)
    assert phases == [change.phase for change in outcome.changes]
    assert outcome.lateness.due == outcome.lateness.tick.size + outcome.lateness.skipped
    taken = outcome.lateness.tick.size - int(np.sum(outcome.lateness.refused))
    assert taken - 2 <= commands <= taken  # a bus that stalls refuses commands, and each is told
    assert ticks.tick.tolist() == outcome.lateness.tick.tolist()
    assert ticks.lateness.tolist() == outcome.lateness.lateness.tolist()
    assert ticks.refused.tolist() == outcome.lateness.refused.tolist()
    assert recording_.description["outcome"]["phase"] == outcome.state.phase.name.lower()


def killing(name: str, when: Phase):
    """Be told of phases, and kill -9 the process of that name when `when` begins."""

    def told(phase: Phase) -> None:
        victims = [child for child in multiprocessing.active_children() if child.name == name]
        if phase == when and victims:
            os.kill(victims[0].pid, signal.SIGKILL)

    return told


def long_armed():
    """A trial that stays armed long enough for a kill, however late a busy machine is with it."""
    return prepared(armed_for_at_most="20 s", rider__presses_button_after="15 s")


def test_a_loop_that_is_killed_leaves_its_frames_its_ticks_and_a_word_about_it(tmp_path):
    outcome = ridden(long_armed(), tmp_path / "run", killing("slipbench loop", Phase.ARMED))
    assert not outcome.done
    assert outcome.state.phase == Phase.ARMED
    assert outcome.trip == "the loop's process died (signal 9)"
    recording_ = read(tmp_path / "run")
    assert recording_.description["outcome"]["valid"] is False
    assert recording_.description["outcome"]["invalid"] == outcome.trip
    ticks = outcome.lateness
    assert recording_.frame_count > 100
    assert ticks.start + int(ticks.tick[-1]) * ticks.period >= outcome.changes[0].time_ns


def test_a_recorder_that_is_killed_ends_the_trial_without_an_excitation(tmp_path):
    """On a machine that stalls it may not get so far; it never excites what nobody records."""
    told = killing("slipbench recorder", Phase.ARMED)
    outcome = ridden(long_armed(), tmp_path / "run", told)
    assert outcome.state.phase == Phase.TRIPPED
    assert outcome.state.trip.reason == TripReason.RECORDER
    assert "the recorder's process died (signal 9)" in outcome.notes


def test_ctrl_c_while_the_outcome_is_written_leaves_it_complete(tmp_path, monkeypatch):
    """A page may ask for a trip while the trial ends by itself."""

    def interrupted(*written):
        signal.raise_signal(signal.SIGINT)
        return end_run(*written)

    monkeypatch.setattr("slipbench.bench.trials.run.end_run", interrupted)
    outcome = ridden(prepared(excitation__duration="200 ms"), tmp_path / "run")
    phase = read(tmp_path / "run").description["outcome"]["phase"]
    assert phase == outcome.state.phase.name.lower()


def stopping(name: str, when: Phase):
    """Be told of phases, and stop the process of that name for good when `when` begins."""

    def told(phase: Phase) -> None:
        victims = [child for child in multiprocessing.active_children() if child.name == name]
        if phase == when and victims:
            os.kill(victims[0].pid, signal.SIGSTOP)

    return told


def test_a_loop_that_is_stopped_for_good_is_ended_and_told(tmp_path, monkeypatch):
    monkeypatch.setattr("slipbench.bench.trials.live_trial.STANDING", 2.0)
    outcome = ridden(prepared(), tmp_path / "run", stopping("slipbench loop", Phase.ARMED))
    assert outcome.trip == "the loop's process died (signal 9)"
    assert "the loop's process stood still for 2 s and was ended" in outcome.notes
    assert read(tmp_path / "run").description["outcome"]["notes"] == list(outcome.notes)


def test_a_vehicle_that_is_stopped_keeps_nobody_from_ending(tmp_path, monkeypatch):
    monkeypatch.setattr("slipbench.bench.vehicle.live_vehicle.END_TIMEOUT", 0.5)
    the_trial = prepared()
    address = BusAddress("slipbench", f"{tmp_path.name}-{os.getpid()}")
    with open_bus(address, receive_own_messages=False) as listener:
        with vehicle_process(the_trial.scenario, the_trial.binding, [address]):
            assert listener.recv(60.0), "it rides, and catches what asks it to end"
            stopping("slipbench vehicle", Phase.IDLE)(Phase.IDLE)
            began = time.monotonic()
        assert time.monotonic() - began >= 0.5
    assert "slipbench vehicle" not in {each.name for each in multiprocessing.active_children()}


def test_on_one_processor_run_toml_tells_that_nobody_spins(tmp_path):
    """Whatever becomes of the trial there: two programs on one processor may be too slow."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    try:
        ridden(prepared(excitation__duration="200 ms"), tmp_path / "run")
    finally:
        os.sched_setaffinity(0, before)
    assert NO_SPIN in read(tmp_path / "run").description["outcome"]["notes"]


class Hanging:
    """A process that does not answer; whether it was killed."""

    killed = False

    def kill(self) -> None:
        self.killed = True


def test_a_bus_whose_driver_hangs_is_told_and_its_process_killed(monkeypatch):
    monkeypatch.setattr("slipbench.bench.trials.live_trial.OPENING", 0.1)
    ours, theirs = multiprocessing.Pipe()
    words = "the CAN bus does not open: interface 'pcan'"
    with ours, theirs, pytest.raises(InputError, match=words) as told:
        _opened(ours, loop := Hanging(), [BusAddress("pcan", "PCAN_USBBUS1")], threading.Event())
    assert loop.killed
    assert "remedy: " in str(told.value)


def test_a_disk_that_takes_no_more_ends_the_trial_and_the_user_is_told_why(tmp_path):
    """The kernel refuses what the recorder writes, as on a full disk, by another number."""

    def told(phase: Phase) -> None:
        for child in multiprocessing.active_children():
            if phase == Phase.ARMED and child.name == "slipbench recorder":
                resource.prlimit(child.pid, resource.RLIMIT_FSIZE, (1000, 1000))

    for attempt in range(3):  # where the machine stalls, the trial trips for that first: once more
        run = tmp_path / f"run-{attempt}"
        outcome = ridden(prepared(armed_for_at_most="20 s"), run, told)
        if outcome.state.trip is None or outcome.state.trip.reason != TripReason.TIMING:
            break
    assert outcome.trip == "the recorder cannot write"
    why = f"the recorder could not write: {os.strerror(errno.EFBIG)}"
    assert why in outcome.notes
    recording_ = read(run)
    assert why in recording_.description["outcome"]["notes"]
    assert recording_.frame_count > 100


@pytest.mark.parametrize(
    ("interface", "words"), [("socketcan", "cannot be opened"), ("nonsense", "cannot be opened")]
)
def test_a_bus_that_cannot_be_opened_is_told_with_the_remedy_and_leaves_no_folder(
    tmp_path, interface, words
):
    with pytest.raises(InputError, match=words):
        run_trial(prepared(), tmp_path / "run", [BusAddress(interface, "no-such-channel")])
    assert not (tmp_path / "run").exists()

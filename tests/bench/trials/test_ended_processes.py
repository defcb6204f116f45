"""A process of a live trial ends: who has to know of it does, and nothing false is recorded."""

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from slipbench.bench.bus.opening import BusAddress
from slipbench.bench.loop.exit_status import exit_reason
from slipbench.bench.loop.loop import Lateness
from slipbench.bench.loop.loop_process import VEHICLE_ENDED, LoopOrder, LoopReport
from slipbench.bench.loop.process_watch import process_pipe
from slipbench.bench.loop.ring import Ring, create_shared
from slipbench.bench.safety.trial import TrialState
from slipbench.bench.trials.live_trial import LiveTrial
from slipbench.bench.trials.run import run_trial
from slipbench.bench.vehicle.live_vehicle import vehicle_process
from slipbench.protocol.codec.messages import Phase, TripReason
from slipbench.protocol.recording.run_folder import read
from tests.bench.trials.test_live import killing
from tests.bench.trials.test_whole_trial import prepared
from tests.paths import TRIALS

WITHIN = 100.0  # s, on a machine however loaded
NO_TICKS = np.zeros(0, np.int64)


class LoopInAThread:
    """Stands for the loop's process. It does not imitate a loop that dies."""

    exitcode = 0

    def __init__(self, pipe, frames) -> None:
        self._pipe, self._frames = pipe, frames

    def run(self) -> None:
        """End the recording, and report only when the recorder has long ended."""
        self._pipe.recv()
        self._frames.close()
        for child in multiprocessing.active_children():
            if child.name == "slipbench recorder":
                os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
        time.sleep(0.5)  # five looks of whoever watches
        lateness = Lateness(NO_TICKS, NO_TICKS, 1_000_000, 0, NO_TICKS.astype(bool))
        self._pipe.send(LoopReport(TrialState(Phase.DONE), (), lateness, ()))


def test_a_recorder_that_ended_properly_before_the_report_came_has_not_failed(tmp_path):
    memory, frames = create_shared()
    ours, theirs = multiprocessing.Pipe()
    watching, watched = process_pipe()
    order = LoopOrder(
        prepared().plan, None, None, [BusAddress("slipbench", "none")], memory.name, "", watching
    )
    loop = LoopInAThread(theirs, frames)
    thread = threading.Thread(target=loop.run)
    thread.start()
    try:
        trial = LiveTrial(loop, ours, frames, Ring.local(), order, None, watched)
        outcome = trial.run(tmp_path, lambda _: None)
        failed = frames.failed
    finally:
        thread.join()
        frames.release()
        memory.close()
        memory.unlink()
    assert not failed
    assert outcome.notes == ()


def children(process: int) -> list[int]:
    return [int(n) for n in Path(f"/proc/{process}/task/{process}/children").read_text().split()]


def recorder_of(process: int) -> int:
    """Process id of the recorder among the children of a trial."""
    for child in children(process):
        for descriptor in Path(f"/proc/{child}/fd").iterdir():
            if descriptor.readlink().name == "frames.log":
                return child
    raise AssertionError("no child of the trial writes frames.log")


def test_a_recorder_that_dies_ends_the_trial_although_the_command_is_stopped(tmp_path):
    """The loop sees it for itself: no ordinary process, which may wait long, stands between."""
    command = [sys.executable, "-m", "slipbench", "trial", TRIALS / "throttle_sweep.toml"]
    with subprocess.Popen(
        [*command, "--real-time", "--out", tmp_path / "run"],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    ) as trial:
        assert trial.stderr
        assert any("armed" in line for line in trial.stderr)
        recorder, vehicle_and_loop = recorder_of(trial.pid), children(trial.pid)
        os.kill(trial.pid, signal.SIGSTOP)
        os.kill(recorder, signal.SIGKILL)
        deadline = time.monotonic() + WITHIN
        while _all_run(set(vehicle_and_loop) - {recorder}) and time.monotonic() < deadline:
            time.sleep(0.01)
        resumed = time.time_ns()
        os.kill(trial.pid, signal.SIGCONT)
        trial.stderr.read()
    phases = read(tmp_path / "run").description["outcome"]["phases"]
    assert phases[-1]["phase"] == "tripped"
    assert phases[-1]["time_ns"] < resumed


def _all_run(processes: set[int]) -> bool:
    """Whether none of these has ended; a process that ended is a zombie until it is reaped."""
    stats = (Path(f"/proc/{process}/stat").read_text() for process in processes)
    return all(stat.rpartition(")")[2].split()[0] != "Z" for stat in stats)


@pytest.mark.parametrize("when", [None, Phase.ARMED])
def test_a_trial_whose_virtual_motorcycle_dies_ends_and_says_so(tmp_path, when):
    """None: it dies before the first tick, as one that gets no memory."""
    the_trial = prepared(armed_for_at_most="20 s")
    address = BusAddress("slipbench", f"{tmp_path.name}-{os.getpid()}")
    told = killing("slipbench vehicle", when)
    with vehicle_process(the_trial.scenario, the_trial.binding, [address]) as vehicle:
        if when is None:
            told(None)
        outcome = run_trial(the_trial, tmp_path / "run", [address], phases=told, vehicle=vehicle)
        assert exit_reason(vehicle.process) == "signal 9"
    assert outcome.state.phase == Phase.TRIPPED
    if when is None:
        assert outcome.state.trip.reason == TripReason.STOPPED
        assert outcome.trip == VEHICLE_ENDED
    assert "the virtual motorcycle's process died (signal 9)" in outcome.notes
    assert read(tmp_path / "run").description["outcome"]["notes"] == list(outcome.notes)

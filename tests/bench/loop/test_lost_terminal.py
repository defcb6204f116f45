"""Loss of the terminal: the trial returns control to the rider, and the record is complete."""

import fcntl
import os
import pty
import signal
import subprocess
import sys
import termios
import time
from pathlib import Path

import pytest

from slipbench.bench.loop.interrupts import termination_signals
from slipbench.protocol.recording.run_folder import read
from tests.paths import TRIALS

WITHIN = 60.0  # s, on a machine however loaded


def own_terminal() -> None:
    """Make the terminal at standard input the controlling terminal, as without `nohup`."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # these tests may run under it themselves
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)


def test_a_trial_that_loses_its_terminal_releases_and_writes_its_description(
    tmp_path: Path,
) -> None:
    ours, theirs = pty.openpty()
    command = [
        sys.executable,
        "-m",
        "slipbench",
        "trial",
        str(TRIALS / "throttle_sweep.toml"),
        "--real-time",
        "--out",
        str(tmp_path / "run"),
    ]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    with subprocess.Popen(
        command,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env=environment,
        start_new_session=True,
        preexec_fn=own_terminal,
    ) as trial:
        os.close(theirs)
        said, deadline = b"", time.monotonic() + WITHIN
        while b"armed" not in said and time.monotonic() < deadline:
            said += os.read(ours, 4096)
        os.close(ours)
        trial.wait(WITHIN)
    recording = read(tmp_path / "run")
    assert recording.description["outcome"]["trip"] == "stopped"
    assert recording.description["outcome"]["notes"] == [
        note for note in recording.description["outcome"]["notes"] if "died" not in note
    ]
    assert recording.frame_count > 100


@pytest.mark.parametrize("ignored", [False, True])
def test_under_nohup_the_loss_of_the_terminal_ends_nothing(ignored: bool) -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN if ignored else signal.SIG_DFL)
    try:
        assert (signal.SIGHUP in termination_signals()) == (not ignored)
        assert {signal.SIGINT, signal.SIGTERM} <= set(termination_signals())
    finally:
        signal.signal(signal.SIGHUP, before)

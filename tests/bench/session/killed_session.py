"""A session on the simulated clock that kills itself, as a power cut would, in a given phase.

python -m tests.bench.session.killed_session PLAN FOLDER PHASE
"""

import os
import signal
import sys
from itertools import count
from pathlib import Path

from slipbench.bench.session import session, session_folder
from slipbench.bench.session.rider_line import ArmingWatch
from slipbench.bench.trials.connection import Connection
from slipbench.protocol.codec.messages import Phase
from slipbench.session_commands import look

PHASES = ("arming", "exciting", "writing", "before the quick look", "quick look", "its file")


def die(*_: object) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def kill_in(phase: str) -> None:
    """Arrange for the process to be killed in a phase of the first run."""
    if phase == "arming":
        ArmingWatch.reason = die
    elif phase == "exciting":
        kill_in_excitation()
    elif phase == "writing":
        kill_before_replacing("run.toml", 2)
    elif phase == "before the quick look":
        session.make_durable = die
    elif phase == "its file":
        kill_before_replacing(session_folder.QUICK_LOOK, 1)


def kill_in_excitation() -> None:
    progress = session._RiderLines.progress

    def in_excitation(self: session._RiderLines, seconds: float) -> None:
        progress(self, seconds)
        if self._phase == Phase.EXCITING and seconds > 2.5:
            die()

    session._RiderLines.progress = in_excitation


def kill_before_replacing(name: str, time: int) -> None:
    """Kill when the draft of a file is written, the `time`-th time, and is not yet renamed."""
    rename, times = Path.replace, count(1)

    def replace(self: Path, target: Path) -> Path:
        if target.name == name and next(times) == time:
            die()
        return rename(self, target)

    Path.replace = replace


def main(plan: Path, folder: Path, phase: str) -> None:
    assert phase in PHASES
    kill_in(phase)
    with session_folder.locked(folder):
        opened = session.open_session(plan, folder)
        session.run_session(opened, Connection(), die if phase == "quick look" else look, print)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])

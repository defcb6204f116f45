"""Serve the view of a folder until Ctrl-C: a replay, or what another command records."""

import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, closing, nullcontext
from pathlib import Path

from slipbench.bench.loop.clock import MonotonicClock
from slipbench.bench.loop.interrupts import interrupts
from slipbench.bench.view.access import Access, Address
from slipbench.bench.view.live_run import LiveView
from slipbench.bench.view.outcome_file import EndOfRun
from slipbench.bench.view.recorded_trial import recorded_trial
from slipbench.bench.view.replay_run import ReplayRun
from slipbench.bench.view.run_list import RUNS
from slipbench.bench.view.server import application
from slipbench.bench.view.sources import LiveSource, ReplaySource
from slipbench.bench.view.terminal import terminal_app
from slipbench.bench.view.web import listen, require_web, run_server, urls

Beside = Callable[[Path, bool], AbstractContextManager[None]]


def nothing_beside(_folder: Path, _replayed: bool) -> AbstractContextManager[None]:
    """Serve the page alone."""
    return nullcontext()


def serve_folder(
    folder: Path, address: Address, say: Callable[[str], None], beside: Beside = nothing_beside
) -> None:
    """Serve a run folder or the folder of a session until Ctrl-C.

    say     receives lines for people
    beside  serves the same folder in another way; it is notified whether the run is replayed

    Raises InputError where the folder holds no trial, an extra is missing, or an address cannot be
    used.
    """
    require_web()
    clock, stop, replayed = MonotonicClock(), threading.Event(), False
    source: LiveSource | ReplaySource
    if (folder / RUNS).is_dir():
        source = LiveSource(LiveView(folder, clock))
    elif has_ended(folder):
        ReplayRun(folder, clock).close()  # raises where it cannot be replayed
        source, replayed = ReplaySource(lambda: ReplayRun(folder, clock)), True
    else:
        recorded_trial(folder)
        source = LiveSource(LiveView(folder, clock))
    with listen(address) as listening:
        port = listening.getsockname()[1]
        access = Access(open_to_all=address.loopback)
        app = application(source, access, f"slipbench_{port}")
        with run_server(app, listening), beside(folder, replayed), interrupts(stop):
            for line in urls(address, port, access):
                say(line)
            stop.wait()


def watch_folder(folder: Path) -> None:
    """Show a run folder or the folder of a session in the terminal until q is pressed.

    Raises InputError where the folder holds no trial, or the extra is missing.
    """
    clock = MonotonicClock()
    if (folder / RUNS).is_dir() or not has_ended(folder):
        if not (folder / RUNS).is_dir():
            recorded_trial(folder)
        live = LiveView(folder, clock)
        terminal_app(lambda: live.update()[1]).run()
        return
    with closing(ReplayRun(folder, clock)) as replay:
        terminal_app(replay.update, replay.control).run()


def has_ended(folder: Path) -> bool:
    """Whether the trial of a run folder has ended, by run.toml."""
    end = EndOfRun(folder)
    end.read()
    return bool(end.outcome)

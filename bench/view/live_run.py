"""The run that is recorded now, read from its folder while the recorder writes it."""

from collections import deque
from pathlib import Path
from typing import Any

from slipbench.bench.loop.clock import Clock
from slipbench.bench.loop.ticks import TICKS
from slipbench.bench.view.log_tail import LogTail
from slipbench.bench.view.message import scaled, state_message, trial_message
from slipbench.bench.view.observer import TrialObserver
from slipbench.bench.view.outcome_file import EndOfRun
from slipbench.bench.view.portion import Portion
from slipbench.bench.view.recorded_trial import RecordedTrial, recorded_trial
from slipbench.bench.view.run_list import RunList
from slipbench.bench.view.tick_watch import TickWatch
from slipbench.protocol.recording.run_folder import FRAMES

KEPT = 3000  # samples that a page gets when it connects: 30 s
FILES_EVERY = 10  # updates between two looks at run.toml, the quick look and the list of runs


class LiveRun:
    """Reader of one run folder, which holds at least the description."""

    def __init__(self, folder: Path, clock: Clock, lag: float = 0) -> None:
        """Begin at the first frame. Raises InputError where the folder is not that of a trial.

        lag: see LogTail
        """
        self.recorded = recorded_trial(folder)
        self.folder, self._trial, self._clock = folder, self.recorded.plan.trial, clock
        self._frames = LogTail(folder / FRAMES, lag=lag)
        self._ticks = LogTail(folder / TICKS, lag=lag)
        self._observer, self._tick_watch = TrialObserver(self.recorded), TickWatch()
        self._end = EndOfRun(folder)
        self._start: float | None = None
        self._grown = clock.now_ns()
        self._kept: deque[list[float]] = deque(maxlen=KEPT)

    @property
    def over(self) -> bool:
        """Whether the trial has ended, by run.toml."""
        return bool(self._end.outcome)

    @property
    def behind(self) -> int:
        """Bytes of the recorded frames that were not read."""
        return self._frames.behind

    def hello(self) -> dict[str, Any]:
        """Data of a page before the first update: the trial, and the samples so far."""
        return {"run": self.folder.name, "samples": list(self._kept), **trial_message(self._trial)}

    def read(self, files: bool) -> Portion:
        """Frames that were recorded since the last call. files: read the small files as well."""
        before = self._frames.skipped
        lines = self._frames.read()
        if self._frames.skipped != before:
            self._observer.skipped()
        if lines:
            self._grown = self._clock.now_ns()
        log = self._observer.observe(lines)
        self._tick_watch.observe(self._ticks.read())
        if files:
            self._end.read()
        observed, samples = self._observer.observed(), self._observer.samples()
        return Portion(log, observed, samples, self._tick_watch.figures())

    def update(self, files: bool) -> dict[str, Any]:
        """State after all frames that were recorded by now. files: read the small files as well."""
        portion = self.read(files)
        if self._start is None and portion.samples:
            self._start = portion.samples[0][0]
        shown = scaled(portion.samples, self._start or 0.0)
        self._kept.extend(shown)
        return {
            "run": self.folder.name,
            **state_message(portion.seen, self._trial, self._start or 0.0),
            "silent": (self._clock.now_ns() - self._grown) * 1e-9,
            "lateness": portion.lateness,
            "not_read": self._frames.skipped,
            "samples": shown,
            **self._end.last_phase(),
            "outcome": self._end.outcome,
            "look": self._end.look,
        }


class LiveView:
    """The newest run below a folder; a session goes from one run to the next."""

    def __init__(self, root: Path, clock: Clock, lag: float = 0) -> None:
        """Watch `root`: the folder of a session, or a run folder, which need not exist yet.

        lag: see LogTail
        """
        self._runs, self._clock, self._lag = RunList(root), clock, lag
        self._run: LiveRun | None = None
        self._rows: list[dict[str, Any]] = []
        self._count = 0

    @property
    def running(self) -> bool:
        """Whether a trial runs."""
        return self._run is not None and not self._run.over

    def hello(self) -> dict[str, Any]:
        """Data of a page before the first update."""
        return {"run": None, "samples": []} if self._run is None else self._run.hello()

    @property
    def recorded(self) -> RecordedTrial | None:
        """The trial that is followed; None before the first one."""
        return None if self._run is None else self._run.recorded

    @property
    def behind(self) -> int:
        """Bytes of the recorded frames that were not read."""
        return 0 if self._run is None else self._run.behind

    @property
    def complete(self) -> bool:
        """Whether all frames of the newest run were read, by now."""
        newest, run = self._runs.current(), self._run
        return newest is None or (run is not None and run.folder == newest and not run.behind)

    def read(self) -> tuple[bool, Portion | None]:
        """Whether another run began, and the new frames of this run.

        None before the first run, and where one began: its first frames come with the next call.
        """
        files, began = self._look()
        return began, None if began or self._run is None else self._run.read(files)

    def update(self) -> tuple[bool, dict[str, Any]]:
        """Whether another run began, and the state now."""
        files, began = self._look()
        if files:
            self._rows = self._runs.rows()
        state: dict[str, Any] = {"run": None, "line": "the recording has not begun", "samples": []}
        if self._run is not None:
            state = self._run.update(files)
        return began, {**state, "runs": self._rows, "running": self.running}

    def _look(self) -> tuple[bool, bool]:
        """Whether this update reads the small files, and whether another run began."""
        files = self._count % FILES_EVERY == 0
        self._count += 1
        return files, files and self._follow()

    def _follow(self) -> bool:
        newest = self._runs.current()
        if newest is None or (self._run is not None and newest == self._run.folder):
            return False
        if self._run is not None and (not newest.exists() or self._run.behind):
            return False
        self._run = LiveRun(newest, self._clock, self._lag)
        return True

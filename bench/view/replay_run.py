"""A recorded run replayed for the view, with its own clock: play, pause, seek."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from slipbench.bench.loop.clock import SECOND, Clock
from slipbench.bench.loop.ticks import TICKS
from slipbench.bench.view.message import scaled, state_message, trial_message
from slipbench.bench.view.observer import TrialObserver
from slipbench.bench.view.outcome_file import EndOfRun
from slipbench.bench.view.recorded_trial import recorded_trial
from slipbench.bench.view.run_list import RunList
from slipbench.bench.view.tick_watch import TickWatch
from slipbench.bench.view.timed_lines import TimedLines, frame_time, tick_time
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.run_folder import FRAMES

WARM_UP = (
    20 * SECOND
)  # ns before the place of a seek from which frames are read: what the charts show
BEFORE = SECOND  # ns before the button: distance and limits count from it
FARTHEST = 90 * SECOND  # ns; a button that is longer ago is not read again


class ReplayRun:
    """One viewer's replay. The clock of the recording starts at its first frame."""

    def __init__(self, folder: Path, clock: Clock) -> None:
        """Begin to play at the first frame. Raises InputError where the folder has no frames."""
        self._recorded, self._clock = recorded_trial(folder), clock
        self._frames = TimedLines(folder / FRAMES, frame_time)
        try:
            self._first, self._last = self._frames.bounds()
        except ValueError as cause:
            raise InputError("the recording has no frames", where=str(folder / FRAMES)) from cause
        self._end, self._rows = EndOfRun(folder), RunList(folder).rows()
        self._end.read()
        self._playing, self._at, self._since = True, 0, clock.now_ns()
        self._ticks: TimedLines | None = None
        self._restart(self._first)

    def close(self) -> None:
        """Close the files of the recording."""
        self._frames.close()
        if self._ticks is not None:
            self._ticks.close()

    @property
    def position(self) -> int:
        """Time of the replay since the first frame, ns; it stops at the last one."""
        moved = self._clock.now_ns() - self._since if self._playing else 0
        return min(self._at + moved, self._last - self._first)

    def control(self, wish: Mapping[str, Any]) -> bool:
        """Whether a page has to start again: after a seek. wish: {"play": bool} or {"seek": s}."""
        if isinstance(wish.get("play"), bool):
            self._set(self.position)
            self._playing = wish["play"]
        seek = wish.get("seek")
        if isinstance(seek, bool) or not isinstance(seek, int | float):
            return False
        self._set(round(min(max(float(seek), 0.0), (self._last - self._first) / SECOND) * SECOND))
        self._restart(self._start_of(self._first + self._at))
        return True

    def hello(self) -> dict[str, Any]:
        """What a page needs before the first update."""
        trial = self._recorded.plan.trial
        duration = (self._last - self._first) / SECOND
        run = self._recorded.folder.name
        return {"run": run, "samples": [], "duration": duration, **trial_message(trial)}

    def update(self) -> dict[str, Any]:
        """State at the time of the replay."""
        now = self._first + self.position
        self._observer.observe(self._frames.until(now))
        if self._ticks is not None:
            self._tick_watch.observe(self._ticks.until(now))
        start = self._first / SECOND
        seen = self._observer.observed()
        ended = now >= self._last
        return {
            "run": self._recorded.folder.name,
            **state_message(seen, self._recorded.plan.trial, start),
            "lateness": self._tick_watch.figures(),
            "samples": scaled(self._observer.samples(), start),
            **(self._end.last_phase() if ended else {}),
            "outcome": self._end.outcome if ended else {},
            "look": self._end.look if ended else {},
            "runs": self._rows,
            "running": False,
            "position": self.position / SECOND,
            "playing": self._playing and not ended,
        }

    def _start_of(self, time_ns: int) -> int:
        """Time from which frames are read, so that the state at a time is known, ns."""
        pressed = [at - BEFORE for at in self._end.pressed if time_ns - FARTHEST < at <= time_ns]
        return min([time_ns - WARM_UP, *pressed[-1:]])

    def _set(self, position: int) -> None:
        """Continue from a position, ns."""
        self._at, self._since = position, self._clock.now_ns()

    def _restart(self, time_ns: int) -> None:
        """Read anew from the first line at or after a time (ns)."""
        self._observer, self._tick_watch = TrialObserver(self._recorded), TickWatch()
        self._frames.seek(time_ns)
        path = self._recorded.folder / TICKS
        if self._ticks is None and path.exists():
            self._ticks = TimedLines(path, tick_time)
        if self._ticks is not None:
            self._ticks.seek(time_ns)

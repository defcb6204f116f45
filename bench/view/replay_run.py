"""A recorded run replayed for the view, with its own clock: play, pause, seek."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from slipbench.bench.loop.clock import SECOND, Clock
from slipbench.bench.loop.ticks import TICKS
from slipbench.bench.view.message import scaled, state_message, trial_message
from slipbench.bench.view.observer import TrialObserver
from slipbench.bench.view.outcome_file import EndOfRun
from slipbench.bench.view.portion import Portion
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
SLOWEST, FASTEST = 0.01, 100.0  # s of the recording in a second
FARTHEST = 90 * SECOND  # ns; a button that is longer ago is not read again


class ReplayRun:
    """One viewer's replay. The clock of the recording starts at its first frame."""

    def __init__(self, folder: Path, clock: Clock) -> None:
        """Begin to play at the first frame. Raises InputError where the folder has no frames."""
        self.recorded, self._clock = recorded_trial(folder), clock
        self._frames = TimedLines(folder / FRAMES, frame_time)
        try:
            self._first, self._last = self._frames.bounds()
        except ValueError as cause:
            raise InputError("the recording has no frames", where=str(folder / FRAMES)) from cause
        self._end, self._rows = EndOfRun(folder), RunList(folder).rows()
        self._end.read()
        self._playing, self._at, self._since, self._speed = True, 0, clock.now_ns(), 1.0
        self._ticks: TimedLines | None = None
        self._begin = self._first
        self._restart(self._first)

    def close(self) -> None:
        """Close the files of the recording."""
        self._frames.close()
        if self._ticks is not None:
            self._ticks.close()

    @property
    def bounds(self) -> tuple[int, int]:
        """Time of the first and of the last frame, ns."""
        return self._first, self._last

    @property
    def begin(self) -> int:
        """Time of the last seek, or of the first frame, ns."""
        return self._begin

    @property
    def position(self) -> int:
        """Time of the replay since the first frame, ns; it stops at the last one."""
        moved = round((self._clock.now_ns() - self._since) * self._speed) if self._playing else 0
        return min(self._at + moved, self._last - self._first)

    @property
    def playing(self) -> bool:
        """Whether the time of the replay goes on."""
        return self._playing and not self.ended

    @property
    def ended(self) -> bool:
        """Whether the replay is at the last frame."""
        return self.position >= self._last - self._first

    @property
    def speed(self) -> float:
        """Seconds of the recording in a second."""
        return self._speed

    def control(self, wish: Mapping[str, Any]) -> bool:
        """Whether a page has to start again: after a seek.

        wish: {"play": bool}, {"speed": s of the recording in a second} or {"seek": s}, or several
        """
        self._set(self.position)
        if isinstance(wish.get("play"), bool):
            self._playing = wish["play"]
        if (speed := _number(wish.get("speed"))) is not None and speed > 0.0:
            self._speed = min(max(speed, SLOWEST), FASTEST)
        if (seek := _number(wish.get("seek"))) is None:
            return False
        self._set(round(min(max(seek, 0.0), (self._last - self._first) / SECOND) * SECOND))
        self._begin = self._first + self._at
        self._restart(self._start_of(self._begin))
        self._set(self._at)  # the time that the seek took is not played
        return True

    def hello(self) -> dict[str, Any]:
        """Data of a page before the first update."""
        trial = self.recorded.plan.trial
        duration = (self._last - self._first) / SECOND
        run = self.recorded.folder.name
        return {"run": run, "samples": [], "duration": duration, **trial_message(trial)}

    def read(self) -> Portion:
        """Frames up to the time of the replay, since the last call."""
        now = self._first + self.position
        log = self._observer.observe(self._frames.until(now))
        if self._ticks is not None:
            self._tick_watch.observe(self._ticks.until(now))
        observed, samples = self._observer.observed(), self._observer.samples()
        return Portion(log, observed, samples, self._tick_watch.figures(), self._begin)

    def update(self) -> dict[str, Any]:
        """State at the time of the replay."""
        ended, start = self.ended, self._first / SECOND
        portion = self.read()
        return {
            "run": self.recorded.folder.name,
            **state_message(portion.seen, self.recorded.plan.trial, start),
            "lateness": portion.lateness,
            "samples": scaled(portion.samples, start),
            **(self._end.last_phase() if ended else {}),
            "outcome": self._end.outcome if ended else {},
            "look": self._end.look if ended else {},
            "runs": self._rows,
            "running": False,
            "position": self.position / SECOND,
            "playing": self.playing,
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
        self._observer, self._tick_watch = TrialObserver(self.recorded), TickWatch()
        self._frames.seek(time_ns)
        path = self.recorded.folder / TICKS
        if self._ticks is None and path.exists():
            self._ticks = TimedLines(path, tick_time)
        if self._ticks is not None:
            self._ticks.seek(time_ns)


def _number(value: object) -> float | None:
    """Finite number of a request; None where it is none."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)

"""Replay: the frames of a log go onto one bus or several, in order and never early."""

from collections.abc import Sequence
from dataclasses import dataclass

import can
import numpy as np
import numpy.typing as npt

from slipbench.bench.loop.clock import SECOND, Clock
from slipbench.bench.replay.replay_controls import Controls
from slipbench.protocol.logs.frame_log import FrameLog

PATIENCE = 2.0  # s for which a bus may refuse frames before the replay gives up
NAP = 20_000_000  # ns: a wait is cut into naps, so that a pause or a seek is noticed
NEVER = -1


@dataclass(frozen=True)
class ReplayResult:
    """What a replay did.

    lateness  (n,) int64, ns from when a frame was due to when it was handed to its bus, the last
              time that it was sent; NEVER where it was not
    sent      frames sent in all, those of every pass counted
    refused   frames that a bus took only at a second try, its queue being full
    passes    times that the whole log went by
    speeds    each speed, times as fast as recorded, with the place in the log (ns) where it began
    """

    lateness: npt.NDArray[np.int64]
    sent: int
    refused: int
    passes: int
    speeds: tuple[tuple[int, float], ...] = ()

    @property
    def known(self) -> npt.NDArray[np.int64]:
        """Lateness of the frames that were sent, ns."""
        known: npt.NDArray[np.int64] = self.lateness[self.lateness != NEVER]
        return known


def replay(
    log: FrameLog, outputs: Sequence[can.BusABC], clock: Clock, controls: Controls
) -> ReplayResult:
    """Send every frame of `log` on the bus of `outputs` that stands for its bus in the log.

    Each frame has an absolute deadline from the log's own times, so that delays do not add up; it
    is made ready before, and handed over when that has come. Raises can.CanError where a bus
    refuses a frame for longer than it takes to empty a queue.
    """
    return _Player(log, outputs, clock, controls).play()


class _Player:
    """A place in the log and the moment at which it was there; from these comes every deadline."""

    def __init__(
        self, log: FrameLog, outputs: Sequence[can.BusABC], clock: Clock, controls: Controls
    ) -> None:
        self._log, self._outputs, self._clock, self._controls = log, outputs, clock, controls
        self._times = log.time_ns - log.time_ns[:1]
        self._lateness = np.full(len(log), NEVER, np.int64)
        self._sent = self._refused = self._passes = 0
        self._next = 0
        self._place, self._moment = 0.0, clock.now_ns()  # ns in the log, ns on the clock
        self._speed, self._seen = controls.speed, 0  # changes made before the start hold as well
        self._speeds = [(0, self._speed)]

    def play(self) -> ReplayResult:
        """Play until the last pass is over or somebody stops it."""
        while not self._controls.stopped and self._more():
            message = _message(self._log, self._next)
            due = self._due(float(self._times[self._next]))
            if not self._wait(due):
                self._heed()
                continue
            self._lateness[self._next] = self._clock.now_ns() - due
            self._insist(self._outputs[self._log.bus[self._next]], message)
            self._next += 1
            self._sent += 1
            self._controls.report_progress(self._sent, self._next, int(self._times[self._next - 1]))
        return ReplayResult(
            self._lateness, self._sent, self._refused, self._passes, tuple(self._speeds)
        )

    def _due(self, place: float) -> int:
        """Moment at which `place` is reached, rounded up: never early."""
        return self._moment + int(np.ceil((place - self._place) / self._speed))

    def _wait(self, due: int) -> bool:
        """Wait until `due`; False where something was changed meanwhile."""
        while self._controls.changes == self._seen:
            nap = self._clock.now_ns() + NAP
            self._clock.sleep_until_ns(min(due, nap))
            if nap >= due:
                return self._controls.changes == self._seen
        return False

    def _heed(self) -> None:
        """Take up the controls' changes from the place that has been reached by now."""
        now = self._clock.now_ns()
        reached = self._place + (now - self._moment) * self._speed
        earliest = float(self._times[self._next - 1]) if self._next else 0.0
        latest = float(self._times[self._next])
        self._place = min(max(reached, earliest), latest)
        self._seen = self._controls.changes
        while self._controls.paused and not self._controls.stopped:
            self._clock.sleep_until_ns(self._clock.now_ns() + NAP)
            self._seen = self._controls.changes
        if (target := self._controls.take_seek()) is not None:
            self._place = float(target)
            self._next = int(np.searchsorted(self._times, target))
        self._moment = self._clock.now_ns()
        if self._speed != self._controls.speed:
            self._speed = self._controls.speed
            self._speeds.append((int(self._place), self._speed))

    def _more(self) -> bool:
        """Tell whether a frame is left; after the last one the next pass begins, if there is one.

        It begins a mean distance of two frames later: one pass joins the other as if it went on.
        """
        if self._next < len(self._log):
            return True
        self._passes += 1
        if not len(self._log) or self._passes == self._controls.passes:
            return False
        spacing = float(self._times[-1]) / max(len(self._log) - 1, 1)
        self._moment = self._due(float(self._times[-1]) + max(spacing, 1.0))
        self._place, self._next = 0.0, 0
        return True

    def _insist(self, bus: can.BusABC, message: can.Message) -> None:
        """Send, trying again while the queue of the controller is full (ENOBUFS)."""
        give_up = self._clock.now_ns() + round(PATIENCE * SECOND)
        refused = False
        while True:
            try:
                bus.send(message)
            except can.CanOperationError:
                refused = True
                if self._clock.now_ns() > give_up:
                    raise
                self._clock.sleep_until_ns(self._clock.now_ns() + 100_000)
            else:
                self._refused += refused
                return


def _message(log: FrameLog, index: int) -> can.Message:
    flags = 0 if log.fd_flags is None else int(log.fd_flags[index])
    return can.Message(
        arbitration_id=int(log.identifier[index]),
        is_extended_id=bool(log.extended[index]),
        is_fd=bool(log.fd[index]),
        bitrate_switch=bool(flags & 1),
        error_state_indicator=bool(flags & 2),
        data=log.data[index, : log.length[index]].tobytes(),
    )

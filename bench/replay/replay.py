"""Replay of the frames of a log on one or more buses, in order and never early."""

from collections.abc import Sequence
from dataclasses import dataclass

import can
import numpy as np
import numpy.typing as npt

from slipbench.bench.loop.clock import SECOND, Clock
from slipbench.bench.replay.replay_controls import Controls
from slipbench.protocol.logs.frame_log import FrameLog

SEND_TIMEOUT = 2.0  # s for which a bus may refuse a frame before the replay ends
LONGEST_WAIT = 20_000_000  # ns: a wait is split, so that a pause or a seek is noticed
NOT_SENT = -1


@dataclass(frozen=True)
class ReplayResult:
    """Result of a replay.

    lateness  (n,) int64, ns from the due time of a frame to the time at which it was passed to its
              bus, in the last pass that sent it; NOT_SENT where none did
    sent      number of frames sent, over all passes
    refused   number of frames that were sent again because the transmit queue was full
    passes    number of complete passes
    speeds    each speed with the position in the log (ns) from which it applied; 1: as recorded
    """

    lateness: npt.NDArray[np.int64]
    sent: int
    refused: int
    passes: int
    speeds: tuple[tuple[int, float], ...] = ()

    @property
    def of_sent_frames(self) -> npt.NDArray[np.int64]:
        """Lateness of the frames that were sent, ns, shape (m,)."""
        lateness: npt.NDArray[np.int64] = self.lateness[self.lateness != NOT_SENT]
        return lateness


def replay(
    log: FrameLog, outputs: Sequence[can.BusABC], clock: Clock, controls: Controls
) -> ReplayResult:
    """Result of sending every frame of `log` on its bus; `outputs` has one bus for each of the log.

    Each frame has an absolute deadline, computed from its time in the log, so that delays do not
    accumulate. It is prepared before its deadline and sent at its deadline. Raises can.CanError
    where a bus refuses a frame for longer than SEND_TIMEOUT.
    """
    return _Player(log, outputs, clock, controls).play()


class _Player:
    """Position in the log and the time at which it was reached; they determine every deadline."""

    def __init__(
        self, log: FrameLog, outputs: Sequence[can.BusABC], clock: Clock, controls: Controls
    ) -> None:
        self._log, self._outputs, self._clock, self._controls = log, outputs, clock, controls
        self._times = log.time_ns - log.time_ns[:1]
        self._lateness = np.full(len(log), NOT_SENT, np.int64)
        self._sent = self._refused = self._passes = 0
        self._next = 0
        self._position, self._moment = 0.0, clock.now_ns()  # ns in the log, ns on the clock
        self._speed = controls.speed
        self._changes_applied = 0  # changes made before the start are applied as well
        self._speeds = [(0, self._speed)]

    def play(self) -> ReplayResult:
        """Result of the replay, after its last pass or when the controls stop it."""
        while not self._controls.stopped and self._has_frame():
            message = _message(self._log, self._next)
            due = self._due(float(self._times[self._next]))
            if not self._wait(due):
                self._apply_changes()
                continue
            self._lateness[self._next] = self._clock.now_ns() - due
            self._send_with_retries(self._outputs[self._log.bus[self._next]], message)
            self._next += 1
            self._sent += 1
            self._controls.report_progress(self._sent, self._next, int(self._times[self._next - 1]))
        return ReplayResult(
            self._lateness, self._sent, self._refused, self._passes, tuple(self._speeds)
        )

    def _due(self, position: float) -> int:
        """Time of the clock at which `position` (ns) is reached, ns, rounded up: never early."""
        return self._moment + int(np.ceil((position - self._position) / self._speed))

    def _wait(self, due: int) -> bool:
        """Wait until `due` (ns); False where the controls were changed meanwhile."""
        while self._controls.changes == self._changes_applied:
            latest = self._clock.now_ns() + LONGEST_WAIT
            self._clock.sleep_until_ns(min(due, latest))
            if latest >= due:
                return self._controls.changes == self._changes_applied
        return False

    def _apply_changes(self) -> None:
        """Apply changes of the controls from the present position on."""
        now = self._clock.now_ns()
        reached = self._position + (now - self._moment) * self._speed
        earliest = float(self._times[self._next - 1]) if self._next else 0.0
        latest = float(self._times[self._next])
        self._position = min(max(reached, earliest), latest)
        self._changes_applied = self._controls.changes
        while self._controls.paused and not self._controls.stopped:
            self._clock.sleep_until_ns(self._clock.now_ns() + LONGEST_WAIT)
            self._changes_applied = self._controls.changes
        if (target := self._controls.take_seek()) is not None:
            self._position = float(target)
            self._next = int(np.searchsorted(self._times, target))
        self._moment = self._clock.now_ns()
        if self._speed != self._controls.speed:
            self._speed = self._controls.speed
            self._speeds.append((int(self._position), self._speed))

    def _has_frame(self) -> bool:
        """Whether there is a frame to send; after the last frame the next pass begins, if any.

        The next pass begins one mean frame period after the last frame.
        """
        if self._next < len(self._log):
            return True
        self._passes += 1
        if not len(self._log) or self._passes == self._controls.passes:
            return False
        spacing = float(self._times[-1]) / max(len(self._log) - 1, 1)
        self._moment = self._due(float(self._times[-1]) + max(spacing, 1.0))
        self._position, self._next = 0.0, 0
        return True

    def _send_with_retries(self, bus: can.BusABC, message: can.Message) -> None:
        """Send a message, and again while the transmit queue is full (ENOBUFS)."""
        deadline = self._clock.now_ns() + round(SEND_TIMEOUT * SECOND)
        refused = False
        while True:
            try:
                bus.send(message)
            except can.CanOperationError:
                refused = True
                if self._clock.now_ns() > deadline:
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

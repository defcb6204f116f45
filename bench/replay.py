"""Replay: the frames of a log go onto a bus, in order and never early."""

from collections.abc import Callable
from dataclasses import dataclass

import can
import numpy as np
import numpy.typing as npt

from bench.clock import SECOND, Clock
from protocol.errors import InputError
from protocol.frame_log import FrameLog

PATIENCE = 2.0  # s for which a bus may refuse frames before the replay gives up


@dataclass(frozen=True)
class Replayed:
    """What a replay did: frames sent, and how late each was (ns, never negative)."""

    lateness: npt.NDArray[np.int64]

    @property
    def count(self) -> int:
        """Count the frames."""
        return int(self.lateness.size)


def replay(
    log: FrameLog,
    bus: can.BusABC,
    clock: Clock,
    speed: float = 1.0,
    progress: Callable[[int], None] = lambda _: None,
) -> Replayed:
    """Send every frame of `log` on `bus`, `speed` times as fast as it was recorded.

    Each frame has an absolute deadline from the log's own times, so that delays do not add up.
    Raises can.CanError where the bus refuses a frame for longer than it takes to empty a queue.
    """
    times = (log.time_ns - log.time_ns[:1]) / speed
    due = clock.now_ns() + np.asarray(times, np.int64)
    lateness = np.empty(len(log), np.int64)
    for index in range(len(log)):
        deadline = int(due[index])
        clock.sleep_until_ns(deadline)
        _insist(bus, _message(log, index), clock)
        lateness[index] = clock.now_ns() - deadline
        if index % 1000 == 0:
            progress(index)
    progress(len(log))
    return Replayed(lateness)


def select_bus(log: FrameLog, bus: str | None, where: str) -> FrameLog:
    """Keep the frames of one bus; raises InputError where the log does not have it."""
    if bus is None:
        return log
    if bus not in log.buses:
        raise InputError(
            f"the log has no bus {bus!r}", where=where, expected=" or ".join(log.buses), found=bus
        )
    return log.select(log.bus == log.buses.index(bus))


def told(replayed: Replayed) -> str:
    """Say in a line what a replay did."""
    p50, p99, most = np.percentile(replayed.lateness, [50, 99, 100]) * 1e-6
    return (
        f"{replayed.count} frames replayed; lateness p50 {p50:.3f} ms, p99 {p99:.3f} ms, "
        f"most {most:.3f} ms"
    )


def _message(log: FrameLog, index: int) -> can.Message:
    return can.Message(
        arbitration_id=int(log.identifier[index]),
        is_extended_id=bool(log.extended[index]),
        is_fd=bool(log.fd[index]),
        data=log.data[index, : log.length[index]].tobytes(),
    )


def _insist(bus: can.BusABC, message: can.Message, clock: Clock) -> None:
    """Send, trying again while the queue of the controller is full (ENOBUFS)."""
    give_up = clock.now_ns() + round(PATIENCE * SECOND)
    while True:
        try:
            bus.send(message)
        except can.CanOperationError:
            if clock.now_ns() > give_up:
                raise
            clock.sleep_until_ns(clock.now_ns() + 100_000)
        else:
            return

"""Faults of the bench: its processes, its disk, its ring buffer and its clock.

On the simulated clock, a killed process is one whose calls no longer happen, and a stopped process
one whose calls do not happen for a while. tests/socketcan/inside/test_faults.py has real signals and
real processes.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

from slipbench.bench.loop.clock import SECOND, SimulatedClock
from slipbench.bench.loop.recorder import Recorder, open_log
from slipbench.bench.loop.ring import Ring
from slipbench.bench.trials.simulated_trial import START
from tests.faults.devices import AT, GroundTruth

STOPPED_FOR = 0.1  # s
SMALL_RING = 64  # slots


class Killed(BaseException):
    """The process was killed."""


@contextmanager
def nothing(_: GroundTruth) -> Iterator[None]:
    yield


@contextmanager
def full_disk(truth: GroundTruth) -> Iterator[None]:
    """From `AT` on every write is refused."""

    def opened(path: Path) -> Any:
        log = open_log(path)

        def write(data: bytes) -> int:
            if truth.now >= AT:
                raise OSError(28, "No space left on device")
            return log.write(data)

        disk = mock.MagicMock(wraps=log)
        disk.write, disk.__enter__.return_value = write, disk
        disk.__exit__.side_effect = lambda *_: log.close()
        return disk

    with mock.patch("slipbench.bench.trials.simulated_trial.open_log", opened):
        yield


@contextmanager
def recorder_that_does_not_read(truth: GroundTruth) -> Iterator[None]:
    """From `AT` on the recorder reads no frames from the ring, for `STOPPED_FOR` s."""
    drain, ring = Recorder.drain, Ring.local(SMALL_RING)

    def idle(recorder: Recorder) -> int:
        return 0 if AT <= truth.now < AT + STOPPED_FOR else drain(recorder)

    with (
        mock.patch.object(Recorder, "drain", idle),
        mock.patch("slipbench.bench.trials.simulated_trial.Ring.local", return_value=ring),
    ):
        yield


@contextmanager
def dead_recorder(truth: GroundTruth) -> Iterator[None]:
    """At `AT` the recorder has ended, and the loop marks the ring as failed."""
    drain = Recorder.drain

    def gone(recorder: Recorder) -> int:
        if truth.now < AT:
            return drain(recorder)
        recorder._ring.fail()
        return 0

    with mock.patch.object(Recorder, "drain", gone):
        yield


class Stalling(SimulatedClock):
    """A clock whose process is stopped once for `STOPPED_FOR` s, or killed."""

    wakes_up = True

    def sleep_until_ns(self, deadline: int) -> None:
        before = self.now_ns()
        super().sleep_until_ns(deadline)
        at = START + round(AT * SECOND)
        if before < at <= deadline:
            super().sleep_until_ns(deadline + round(STOPPED_FOR * SECOND))
            if not self.wakes_up:
                raise Killed


class Ending(Stalling):
    """A clock whose process is killed."""

    wakes_up = False


@contextmanager
def stopped_loop(_: GroundTruth) -> Iterator[None]:
    with mock.patch("slipbench.bench.trials.simulated_trial.SimulatedClock", Stalling):
        yield


@contextmanager
def killed_loop(_: GroundTruth) -> Iterator[None]:
    with mock.patch("slipbench.bench.trials.simulated_trial.SimulatedClock", Ending):
        yield

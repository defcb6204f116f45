"""What breaks on the bench's own side: its processes, its disk, its memory and its clock.

On the simulated clock a process that is killed or stopped is one whose calls do not happen any
more, or for a while; real signals and real processes are in tests/socketcan/inside/test_faults.py.
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
from tests.faults.devices import AT, Witness

STOPPED_FOR = 0.1  # s
LITTLE = 64  # slots of a ring that is soon full


class Killed(BaseException):
    """The process is gone."""


@contextmanager
def nothing(_: Witness) -> Iterator[None]:
    yield


@contextmanager
def full_disk(witness: Witness) -> Iterator[None]:
    """From `AT` on every write is refused."""

    def opened(path: Path) -> Any:
        log = open_log(path)

        def write(data: bytes) -> int:
            if witness.now >= AT:
                raise OSError(28, "No space left on device")
            return log.write(data)

        disk = mock.MagicMock(wraps=log)
        disk.write, disk.__enter__.return_value = write, disk
        disk.__exit__.side_effect = lambda *_: log.close()
        return disk

    with mock.patch("slipbench.bench.trials.simulated_trial.open_log", opened):
        yield


@contextmanager
def recorder_that_does_not_read(witness: Witness) -> Iterator[None]:
    """From `AT` on nobody takes frames out of the ring, until the trial is over."""
    drain, ring = Recorder.drain, Ring.local(LITTLE)

    def idle(recorder: Recorder) -> int:
        return 0 if AT <= witness.now < AT + STOPPED_FOR else drain(recorder)

    with (
        mock.patch.object(Recorder, "drain", idle),
        mock.patch("slipbench.bench.trials.simulated_trial.Ring.local", return_value=ring),
    ):
        yield


@contextmanager
def dead_recorder(witness: Witness) -> Iterator[None]:
    """At `AT` the recorder is gone, and whoever watches it says so to the ring."""
    drain = Recorder.drain

    def gone(recorder: Recorder) -> int:
        if witness.now < AT:
            return drain(recorder)
        recorder._ring.fail()
        return 0

    with mock.patch.object(Recorder, "drain", gone):
        yield


class Stalling(SimulatedClock):
    """A clock whose owner sleeps too long, once; or does not wake up again."""

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
    """A clock whose owner is killed."""

    wakes_up = False


@contextmanager
def stopped_loop(_: Witness) -> Iterator[None]:
    with mock.patch("slipbench.bench.trials.simulated_trial.SimulatedClock", Stalling):
        yield


@contextmanager
def killed_loop(_: Witness) -> Iterator[None]:
    with mock.patch("slipbench.bench.trials.simulated_trial.SimulatedClock", Ending):
        yield

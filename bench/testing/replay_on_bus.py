"""Replay of a captured drive on the bus of a test, edited on its way."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from slipbench.bench.replay.edits import Edit, edited
from slipbench.bench.replay.replay import ReplayResult, replay
from slipbench.bench.replay.replay_controls import Controls
from slipbench.bench.replay.replay_selection import select_identifiers
from slipbench.bench.testing.bench_bus import BenchBus
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.frame_log import FrameLog

AFTER_LAST = 0.001  # s, in which the last frame is sent


@dataclass(frozen=True)
class BusClock:
    """The clock of a bus: to wait is to let its time pass."""

    bus: BenchBus

    def now_ns(self) -> int:
        """Time of the clock, ns."""
        return self.bus.line.now_ns()

    def sleep_until_ns(self, deadline: int) -> None:
        """Let time pass until `deadline` (ns)."""
        self.bus.run_until_ns(deadline)


class ReplayOnBus:
    """Replays logs on the bus of a test; devices and triggers run meanwhile."""

    def __init__(self, bus: BenchBus) -> None:
        """Send on a node of its own."""
        self._bus = bus
        self._node = bus.node("replay")

    def run(
        self,
        log: str | Path | FrameLog,
        edits: Sequence[Edit] = (),
        *,
        speed: float = 1.0,
        only: str = "",
        without: str = "",
    ) -> ReplayResult:
        """Result of sending the frames of a log, of all its buses, at their recorded times.

        log: a log of any format, a run folder, or frames. edits: see `bench/replay/edits.py`; only,
        without: identifiers such as "0x10,0x200-0x2FF". Raises InputError where the log cannot be
        read or an edit does not suit it.
        """
        frames = edited(frames_of(log), self._bus.database, edits)
        frames = select_identifiers(frames, only, without)
        for edit in edits:
            self._bus.marks.append((*self._span(edit), str(edit)))
        outputs = [self._node] * len(frames.buses)
        result = replay(frames, outputs, BusClock(self._bus), Controls.local(speed))
        self._bus.run(AFTER_LAST)
        return result

    def _span(self, edit: Edit) -> tuple[float, float]:
        return self._bus.now + edit.begin, self._bus.now + edit.end


def frames_of(log: str | Path | FrameLog) -> FrameLog:
    """Frames of a log file or a run folder. Raises InputError where it has none."""
    if isinstance(log, FrameLog):
        return log
    path = Path(log)
    return read_log(path / "frames.log" if path.is_dir() else path).frames

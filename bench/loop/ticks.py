"""Table of all ticks of the loop in a recording: sent on time, late, refused or skipped.

The loop writes each tick to the ring of its frames; the recorder appends it to ticks.csv. A loop that
is killed therefore loses only the ticks of its last milliseconds. A tick whose command the bus refused
had no effect, even where it was on time.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from slipbench.bench.loop.clock import SECOND
from slipbench.bench.loop.loop import Lateness, TickObserver
from slipbench.bench.loop.ring import TICK, Ring, Slot
from slipbench.protocol.trial_file import TrialFile

TICKS = "ticks.csv"
HEADER = "tick,due_ns,lateness_ns,fate\n"
LARGEST = (1 << 32) - 1  # ns, largest lateness in a slot: over 4 s


def tick_recorder(ring: Ring) -> TickObserver:
    """Observer that writes each tick to `ring`; a full ring is marked as failed, which trips."""

    def note(number: int, due: int, late: int, refused: bool) -> None:
        packed = (number << 1 | refused).to_bytes(8, "little")
        if not ring.append(due, min(late, LARGEST), TICK, packed):
            ring.fail()

    return note


@dataclass
class TickTable:
    """Lines of ticks.csv. period, late: ns; a tick that begins more than `late` ns late is late."""

    period: int
    late: int
    expected: int = 0

    def lines(self, tick: Slot) -> str:
        """Lines of the skipped ticks before a tick, and of the tick itself."""
        packed = int.from_bytes(tick.data, "little")
        number, refused = packed >> 1, packed & 1
        skipped = "".join(
            f"{missing},{tick.time_ns - (number - missing) * self.period},,skipped\n"
            for missing in range(self.expected, number)
        )
        self.expected = number + 1
        fate = "refused" if refused else "late" if tick.identifier > self.late else "sent"
        return f"{skipped}{number},{tick.time_ns},{tick.identifier},{fate}\n"


def tick_table(trial: TrialFile) -> TickTable:
    """Empty table of a trial."""
    return TickTable(round(trial.command.period * SECOND), round(trial.timing.late * SECOND))


def read_ticks(path: Path, period: int) -> Lateness:
    """Lateness of the ticks in a ticks.csv, even of a killed loop. period: ns."""
    if not path.exists():
        nothing = np.zeros(0, np.int64)
        return Lateness(nothing, nothing, period, 0, nothing.astype(np.bool_))
    rows = [line.split(",") for line in path.read_text().splitlines()[1:] if line.count(",") == 3]
    ran = [(int(row[0]), int(row[1]), int(row[2]), row[3] == "refused") for row in rows if row[2]]
    table = np.array(ran, np.int64).reshape(-1, 4)
    start = int(table[-1, 1] - table[-1, 0] * period) if len(table) else 0
    refused = table[:, 3].astype(np.bool_)
    return Lateness(table[:, 0].copy(), table[:, 2].copy(), period, start, refused)

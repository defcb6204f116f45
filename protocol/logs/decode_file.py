"""Decode a log file into a file of samples in portions: a log may be larger than memory."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from slipbench.protocol.database.layout import Database
from slipbench.protocol.logs import LogText, Progress, no_frames, quiet, read_portions
from slipbench.protocol.logs.decode import SortedLog, sort_log
from slipbench.protocol.logs.frame_log import FrameLog
from slipbench.protocol.logs.sample_table import export

AT_ONCE = 2_000_000  # frames; they and what is decoded of them take a few hundred MB


@dataclass
class Tally:
    """Counts of what the portions of a log hold."""

    frames: int = 0
    first: int = 0  # ns
    last: int = 0  # ns
    buses: tuple[str, ...] = ()
    short: Counter[str] = field(default_factory=Counter)
    unknown: Counter[int] = field(default_factory=Counter)
    skipped: Counter[str] = field(default_factory=Counter)

    def of(self, portions: Iterable[SortedLog]) -> Iterator[SortedLog]:
        """The same portions, counted."""
        for portion in portions:
            log = portion.log
            if len(log):
                self.first = int(log.time_ns[0]) if not self.frames else self.first
                self.last = max(self.last, int(log.time_ns[-1]))
            self.frames += len(log)
            self.buses = log.buses
            self.short.update({name: int(rows.size) for name, rows in portion.short.items()})
            self.unknown.update(portion.unknown_identifiers())
            self.skipped.update(dict(log.skipped))
            yield portion


def decode_file(
    path: Path,
    database: Database,
    signals: Sequence[tuple[str, str]],
    out: Path,
    at_once: int = AT_ONCE,
    progress: Progress = quiet,
) -> tuple[LogText, Tally, int]:
    """Write the samples of `signals` in the log `path` to the new file `out`.

    Gives what the log is with every warning, what it held, and the number of samples. Raises
    InputError, and leaves nothing behind, where the log has no data frames.
    """
    text, portions = read_portions(path, at_once, progress)
    tally = Tally()
    sorted_logs = (sort_log(log, database) for log in _not_empty(portions, path, text.format))
    count, exact = export(tally.of(sorted_logs), signals, out)
    for name, rows in exact.items():
        text.warnings.append(
            f"{name}: {rows} whole numbers fit no double: they stand as text in the column `exact`"
        )
    return text, tally, count


def _not_empty(portions: Iterator[FrameLog], path: Path, form: str) -> Iterator[FrameLog]:
    """The same portions. Raises InputError where the first has no frames."""
    for number, log in enumerate(portions):
        if not number and not len(log):
            raise no_frames(path, form, log.skipped)
        yield log

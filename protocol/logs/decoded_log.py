"""A log decoded in memory: every signal as arrays of time and value.

decoded = decode("drive.log", "car.dbc")
decoded["EngineStatus.engine_speed"].value
decoded.to_pandas()
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Database
from slipbench.protocol.extras import optional_library
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.decode import Samples, SortedLog, sort_log
from slipbench.protocol.logs.sample_table import chosen
from slipbench.protocol.notebook import card, table


@dataclass(frozen=True)
class DecodedSignal:
    """Samples of one signal.

    name     "Message.signal"
    time     (m,) s since the log's first frame
    time_ns  (m,) ns as logged
    value    (m,) in `unit`; integers where scale and offset are integers
    unit     as in the database
    bus      (m,) name of the bus of each sample
    label    (m,) the value's name in the database's value table, None where it has none
    """

    name: str
    time: npt.NDArray[np.float64]
    time_ns: npt.NDArray[np.int64]
    value: npt.NDArray[Any]
    unit: str
    bus: npt.NDArray[np.str_]
    label: tuple[str | None, ...]

    def to_pandas(self) -> Any:
        """A pandas.Series of values in `unit`, indexed by time in s. Raises InputError."""
        pandas = optional_library("pandas")
        series = pandas.Series(
            self.value, index=pandas.Index(self.time, name="time"), name=self.name
        )
        series.attrs["unit"] = self.unit
        return series


class DecodedLog(Mapping[str, DecodedSignal]):
    """Decoded signals by "Message.signal", as a read-only mapping.

    frames    number of frames in the log
    unknown   number of frames that the database does not know
    short     number of frames that are shorter than their message
    warnings  what was wrong with the log, in words
    """

    def __init__(
        self,
        signals: Mapping[str, DecodedSignal],
        frames: int,
        unknown: int,
        short: int,
        warnings: Sequence[str],
    ) -> None:
        """Hold the signals and the counts."""
        self._signals = dict(signals)
        self.frames, self.unknown, self.short = frames, unknown, short
        self.warnings = tuple(warnings)

    def __getitem__(self, name: str) -> DecodedSignal:
        """Look up a signal by "Message.signal"."""
        return self._signals[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names in the order of the database."""
        return iter(self._signals)

    def __len__(self) -> int:
        """Count the signals that have samples."""
        return len(self._signals)

    def to_pandas(self) -> Any:
        """A long pandas.DataFrame: one row a sample, ordered by time.

        Columns: time (s since the log's first frame), time_ns, bus, signal, value (in `unit`),
        unit and label. Values are float64. Raises InputError where pandas is not installed.
        """
        pandas = optional_library("pandas")
        parts = [
            pandas.DataFrame(
                {
                    "time": one.time,
                    "time_ns": one.time_ns,
                    "bus": one.bus,
                    "signal": one.name,
                    "value": one.value.astype(np.float64),
                    "unit": one.unit,
                    "label": list(one.label),
                }
            )
            for one in self.values()
        ]
        if not parts:
            return pandas.DataFrame(
                columns=["time", "time_ns", "bus", "signal", "value", "unit", "label"]
            )
        joined = pandas.concat(parts, ignore_index=True)
        return joined.sort_values("time_ns", kind="stable", ignore_index=True)

    def _repr_html_(self) -> str:
        rows = [(one.name, one.unit, one.time.size) for one in self.values()]
        counts = f"{self.frames} frames; unknown identifier: {self.unknown}; short: {self.short}"
        head = ("signal", "unit", "samples")
        return card("Decoded log", [counts, *self.warnings], table(head, rows))


def decode(
    log: str | Path, database: str | Path | Database, signals: Sequence[str] = ()
) -> DecodedLog:
    """Decode a CAN log in memory: time in s and value in the database's unit of every signal.

    log: candump, ASC, BLF, TRC, python-can CSV or MF4, recognized by content. signals: "Message",
    "Message.signal" or "signal"; empty: all. Raises InputError where the log or the database
    cannot be read, where a signal is not in the database, or where the log has no data frames.
    """
    known = database if isinstance(database, Database) else load_database(Path(database))
    pairs = chosen(known, signals)
    reading = read_log(Path(log))
    frames = reading.frames
    by_message = sort_log(frames, known)
    found = {}
    for message, name in pairs:
        samples = by_message.frames[message].samples(name)
        if samples.rows.size:
            found[f"{message}.{name}"] = _signal(by_message, message, samples)
    short = sum(int(rows.size) for rows in by_message.short.values())
    return DecodedLog(found, len(frames), int(by_message.unknown.size), short, reading.warnings)


def _signal(by_message: SortedLog, message: str, samples: Samples) -> DecodedSignal:
    log, signal = by_message.log, samples.signal
    time_ns = log.time_ns[samples.rows]
    return DecodedSignal(
        f"{message}.{signal.name}",
        np.asarray((time_ns - int(log.time_ns[0])) * 1e-9, np.float64),
        time_ns,
        samples.value,
        signal.unit or "",
        np.asarray(log.buses)[log.bus[samples.rows]],
        tuple(samples.names()) if signal.choices else (None,) * time_ns.size,
    )

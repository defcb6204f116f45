"""Every sample of a log in one long table, as pandas, MATLAB and spreadsheets read it.

One row a sample: `time` (s since the log's first frame), `time_ns` (as logged), `bus`, `message`,
`signal`, `value` (in the database's unit), `unit`, `label` (where the database names the value).
Parquet: one row group a signal, so that a reader can take one signal without the rest; a log of
more than some millions of frames is decoded in portions, with one row group a signal in each.
"""

import difflib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from slipbench.protocol.database.layout import Database
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.decode import Samples, SortedLog
from slipbench.protocol.new_file import new_file, refuse_existing

COLUMNS = ("time", "time_ns", "bus", "message", "signal", "value", "unit", "label")


def chosen(database: Database, wanted: Sequence[str]) -> list[tuple[str, str]]:
    """Find the signals that `wanted` names, "Message", "Message.signal" or "signal"; none: all."""
    every = [(m.name, signal.name) for m in database.messages for signal in m.signals]
    if not wanted:
        return every
    found: dict[tuple[str, str], None] = {}
    for name in wanted:
        hits = [pair for pair in every if name in (pair[0], pair[1], ".".join(pair))]
        if not hits:
            raise _no_such_signal(name, every, database.origin)
        found |= dict.fromkeys(hits)
    return list(found)


def _no_such_signal(name: str, every: list[tuple[str, str]], origin: str) -> InputError:
    full = [".".join(pair) for pair in every]
    names = [*full, *(part for pair in every for part in pair)]
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.4)
    return InputError(
        f"the database has no message or signal {name!r}",
        where=origin,
        remedy=f"did you mean {near[0]!r}?" if near else "",
    )


def export(portions: Iterable[SortedLog], signals: Sequence[tuple[str, str]], out: Path) -> int:
    """Number of samples of `signals`, written to a new file portion by portion.

    Raises InputError where `out` exists or cannot be written, or where there is no sample.
    """
    refuse_existing(out)
    write = {".parquet": _write_parquet, ".csv": _write_csv}.get(out.suffix.casefold())
    if write is None:
        raise InputError(
            "what to write is told by the name's ending",
            where=str(out),
            expected=".parquet or .csv",
            found=repr(out.suffix),
        )
    with new_file(out) as draft:
        count = write(_parts(portions, signals), draft)
        if not count:
            raise InputError(
                "there is no sample to write",
                expected="frames of at least one of the selected messages",
                remedy="check that the database is that of the vehicle, or select other signals",
            )
    return count


def _parts(portions: Iterable[SortedLog], signals: Sequence[tuple[str, str]]) -> Iterator[Any]:
    """Make one table for each signal that has samples in a portion."""
    start = None
    for sorted_log in portions:
        if start is None and len(sorted_log.log):
            start = int(sorted_log.log.time_ns[0])
        for message, signal in signals:
            samples = sorted_log.frames[message].samples(signal)
            if samples.rows.size and start is not None:
                yield _table(sorted_log, message, samples, start)


def _table(sorted_log: SortedLog, message: str, samples: Samples, start: int) -> Any:
    import pyarrow as pa

    log, signal = sorted_log.log, samples.signal
    time_ns = log.time_ns[samples.rows]

    def same(text: str) -> Any:
        return pa.DictionaryArray.from_arrays(np.zeros(time_ns.size, np.int32), [text])

    labels = samples.names() if signal.choices else [None] * time_ns.size
    columns = (
        (time_ns - start) * 1e-9,
        time_ns,
        pa.DictionaryArray.from_arrays(log.bus[samples.rows].astype(np.int32), list(log.buses)),
        same(message),
        same(signal.name),
        np.asarray(samples.value, np.float64),
        same(signal.unit),
        pa.array(labels, pa.string()).dictionary_encode(),
    )
    return pa.table(dict(zip(COLUMNS, columns, strict=True)))


def _schema() -> Any:
    import pyarrow as pa

    text = pa.dictionary(pa.int32(), pa.string())
    kinds = (pa.float64(), pa.int64(), text, text, text, pa.float64(), text, text)
    return pa.schema(list(zip(COLUMNS, kinds, strict=True)))


def _write_parquet(parts: Iterator[Any], out: Path) -> int:
    from pyarrow import parquet

    count = 0
    with parquet.ParquetWriter(out, _schema()) as file:
        for part in parts:
            file.write_table(part)
            count += part.num_rows
    return count


def _write_csv(parts: Iterator[Any], out: Path) -> int:
    import pyarrow as pa
    from pyarrow import csv

    plain = pa.schema(
        [
            pa.field(one.name, pa.string() if pa.types.is_dictionary(one.type) else one.type)
            for one in _schema()
        ]
    )
    count = 0
    with csv.CSVWriter(out, plain) as file:
        for part in parts:
            file.write_table(part.cast(plain))
            count += part.num_rows
    return count

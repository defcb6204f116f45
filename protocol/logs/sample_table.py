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
from slipbench.protocol.extras import optional_library
from slipbench.protocol.logs.decode import Samples, SortedLog

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
    """Write the samples of `signals` to a new file, portion by portion; returns their number."""
    if out.exists():
        raise InputError(
            "it exists, and nothing is overwritten",
            where=str(out),
            remedy="give another name with --out, or remove it yourself",
        )
    write = {".parquet": _write_parquet, ".csv": _write_csv}.get(out.suffix.casefold())
    if write is None:
        raise InputError(
            "what to write is told by the name's ending",
            where=str(out),
            expected=".parquet or .csv",
            found=repr(out.suffix),
        )
    draft = out.with_name(out.name + ".part")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        count = write(_parts(portions, signals), draft)
        draft.replace(out)
    except OSError as cause:
        raise InputError("cannot be written", where=str(out), found=str(cause)) from cause
    finally:
        draft.unlink(missing_ok=True)
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
    pa = optional_library("pyarrow")

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
    pa = optional_library("pyarrow")

    text = pa.dictionary(pa.int32(), pa.string())
    kinds = (pa.float64(), pa.int64(), text, text, text, pa.float64(), text, text)
    return pa.schema(list(zip(COLUMNS, kinds, strict=True)))


def _write_parquet(parts: Iterator[Any], out: Path) -> int:
    parquet = optional_library("pyarrow.parquet")

    count = 0
    with parquet.ParquetWriter(out, _schema()) as file:
        for part in parts:
            file.write_table(part)
            count += part.num_rows
    return count


def _write_csv(parts: Iterator[Any], out: Path) -> int:
    pa = optional_library("pyarrow")
    csv = optional_library("pyarrow.csv")

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

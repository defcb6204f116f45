"""Write the samples of a log as one long table, as pandas, MATLAB and spreadsheets read it.

One row per sample: `time` (s since the log's first frame), `time_ns` (as logged), `bus`, `message`,
`signal`, `value` (in the database's unit), `unit`, `label` (where the database names the value).
Parquet: one row group a signal, so that a reader can take one signal without the others; a log of
more than some millions of frames is decoded in portions, with one row group a signal in each.

No whole number is rounded. CSV holds each with all its digits. Parquet has one type for the column
`value`, a double, so it also has the column `exact`: the digits of a whole number that no double
holds (some of those above 2^53); its `value` is then empty.
"""

import difflib
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.protocol.codec.extract import EXACT_BITS
from slipbench.protocol.database.layout import Database
from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.logs.decode import Samples, SortedLog
from slipbench.protocol.new_file import new_file, refuse_existing

COLUMNS = ("time", "time_ns", "bus", "message", "signal", "value", "unit", "label")
EXACT = "exact"


def chosen(database: Database, names: Sequence[str]) -> list[tuple[str, str]]:
    """Message and signal for each of `names`: "Message", "Message.signal" or "signal"; none: all.

    Raises InputError for a name that the database lacks.
    """
    every = [(m.name, signal.name) for m in database.messages for signal in m.signals]
    if not names:
        return every
    found: dict[tuple[str, str], None] = {}
    for name in names:
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


def export(
    portions: Iterable[SortedLog], signals: Sequence[tuple[str, str]], out: Path
) -> tuple[int, dict[str, int]]:
    """Write the samples of `signals` to a new file in portions.

    Returns the number of samples, and of those that stand in the column `exact`, by signal.

    Raises InputError where `out` exists or cannot be written, or where there is no sample.
    """
    refuse_existing(out)
    write = {".parquet": _write_parquet, ".csv": _write_csv}.get(out.suffix.casefold())
    if write is None:
        raise InputError(
            "the ending of the name selects the format",
            where=str(out),
            expected=".parquet or .csv",
            found=repr(out.suffix),
        )
    with new_file(out) as draft:
        count, exact = write(_parts(portions, signals), draft)
        if not count:
            raise InputError(
                "there is no sample to write",
                expected="frames of at least one of the selected messages",
                remedy="check that the database is that of the vehicle, or select other signals",
            )
    return count, exact


def _parts(portions: Iterable[SortedLog], signals: Sequence[tuple[str, str]]) -> Iterator[Any]:
    """One table for each signal that has samples in a portion."""
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
        exact_column(samples.exact),
        same(signal.unit),
        pa.array(labels, pa.string()).dictionary_encode(),
    )
    return pa.table(dict(zip(COLUMNS, columns, strict=True)))


def exact_column(value: npt.NDArray[Any], absent: npt.NDArray[np.bool_] | None = None) -> Any:
    """Arrow array of values as `Samples.exact` has them, (n,), null where `absent`."""
    pa = optional_library("pyarrow")

    return pa.array(value, pa.decimal128(38, 0) if value.dtype == object else None, mask=absent)


def _schema() -> Any:
    pa = optional_library("pyarrow")

    text = pa.dictionary(pa.int32(), pa.string())
    kinds = (pa.float64(), pa.int64(), text, text, text, pa.float64(), text, text, pa.string())
    return pa.schema(list(zip((*COLUMNS, EXACT), kinds, strict=True)))


def _write_parquet(parts: Iterator[Any], out: Path) -> tuple[int, dict[str, int]]:
    parquet = optional_library("pyarrow.parquet")

    count, found = 0, Counter[str]()
    with parquet.ParquetWriter(out, _schema()) as file:
        for part in parts:
            double, exact = _doubles(part["value"].combine_chunks())
            place = part.schema.get_field_index("value")
            file.write_table(part.set_column(place, "value", double).append_column(EXACT, exact))
            count += part.num_rows
            name = f"{part['message'][0]}.{part['signal'][0]}" if part.num_rows else ""
            found[name] += part.num_rows - exact.null_count
    return count, dict(+found)


def _doubles(value: Any) -> tuple[Any, Any]:
    """Values as doubles, null where that would round, and the text of those; null elsewhere."""
    pa = optional_library("pyarrow")
    compute = optional_library("pyarrow.compute")

    if pa.types.is_floating(value.type):
        return value.cast(pa.float64()), pa.nulls(len(value), pa.string())
    double = value.cast(pa.float64(), safe=False)
    far = np.abs(double.to_numpy(zero_copy_only=False)) >= float(1 << EXACT_BITS)
    rounded = np.zeros(len(value), np.bool_)
    for row in np.flatnonzero(far).tolist():
        rounded[row] = int(double[row].as_py()) != int(value[row].as_py())
    mask = pa.array(rounded)
    text = pa.array([str(value[row]) if there else None for row, there in enumerate(rounded)])
    return compute.if_else(mask, None, double), text.cast(pa.string())


def _write_csv(parts: Iterator[Any], out: Path) -> tuple[int, dict[str, int]]:
    pa = optional_library("pyarrow")
    csv = optional_library("pyarrow.csv")

    count = 0
    with out.open("wb") as file:
        for part in parts:
            fields = [
                pa.field(one.name, pa.string() if pa.types.is_dictionary(one.type) else one.type)
                for one in part.schema
            ]
            plain = part.cast(pa.schema(fields))
            csv.write_csv(plain, file, csv.WriteOptions(include_header=not count))
            count += part.num_rows
    return count, {}

"""Read and write tables in Parquet: those of other programs, and the copies in a recording.

A copy keeps every column as it was read, text included; units, and which time column belongs to
which column, stand in the metadata of the columns under "unit" and "clock". The metadata of the whole
table hold the decimal mark of its text under "decimal".
"""

import re
from pathlib import Path
from typing import Any, BinaryIO

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.tables.csv_layout import unique_names
from slipbench.protocol.tables.number_cells import OTHER_MARK
from slipbench.protocol.tables.table import Table
from slipbench.protocol.tables.titles import split_unit
from slipbench.protocol.user_file import open_user_file

MOST_CELLS = 100_000_000  # values: 0.8 GB of doubles
MOST_BYTES = 1 << 30


def read_parquet(path: Path) -> Table:
    """Table of a Parquet file; units from the columns' metadata, or from their names.

    Raises InputError where the file is damaged, or larger than a table of samples.
    """
    pa = optional_library("pyarrow")

    with open_user_file(path) as file:
        try:
            data = _columns(file, str(path))
        except (pa.ArrowException, OSError, UnicodeDecodeError) as cause:
            raise InputError(
                "not a Parquet file that can be read",
                where=str(path),
                found=str(cause)[:200],
                remedy="was it written to its end? write it again",
            ) from cause
    titles = [split_unit(name) for name in data.column_names]
    names = [name for name, _ in titles]
    if len(set(names)) < len(names):
        titles = [(name, "") for name in unique_names(data.column_names)]
    units = {name: unit for name, unit in titles if unit}
    clocks: dict[str, str] = {}
    for (name, _), column in zip(titles, data.schema, strict=True):
        metadata = column.metadata or {}
        units |= {name: metadata[b"unit"].decode(errors="replace")} if b"unit" in metadata else {}
        clocks |= (
            {name: metadata[b"clock"].decode(errors="replace")} if b"clock" in metadata else {}
        )
    metadata = data.schema.metadata or {}
    source = metadata.get(b"source")
    where = source.decode(errors="replace") if source else str(path)
    data = data.rename_columns([name for name, _ in titles])
    lines = _lines(metadata.get(b"lines", b""))
    mark = metadata.get(b"decimal", b"").decode(errors="replace")
    decimal = mark if mark in OTHER_MARK else ""
    return Table(where, data, units, clocks, (), ("Parquet",), lines, decimal)


def _lines(text: bytes) -> tuple[tuple[int, int], ...]:
    """Lines of the rows in the file of which this is the copy; none where they are not stated."""
    pairs = re.findall(rb"(\d{1,12}):(\d{1,12})", text)
    return tuple((int(row), int(line)) for row, line in pairs)


def _columns(file: BinaryIO, where: str) -> Any:
    """Flat columns of a Parquet file as an Arrow table; lists and records hold no samples.

    A small file can unpack to any size: repeated values are packed to a few bytes. Raises
    InputError where the content is larger than a table of samples, before it is unpacked.
    """
    pa = optional_library("pyarrow")
    parquet = optional_library("pyarrow.parquet")

    packed = parquet.ParquetFile(file)
    every = packed.schema_arrow
    schema = pa.schema([one for one in every if not one.type.num_fields], every.metadata)
    count, groups = packed.metadata.num_rows, range(packed.metadata.num_row_groups)
    unpacked = sum(packed.metadata.row_group(n).total_byte_size for n in groups)
    if count * len(schema) > MOST_CELLS or unpacked > MOST_BYTES:
        found = f"{count:,} rows of {len(schema)} columns, {unpacked:,} bytes"
        raise _too_large(where, found)
    texts = [one.name for one in schema if pa.types.is_string(one.type)]
    data = parquet.ParquetFile(file, read_dictionary=texts).read(columns=schema.names)
    packed_texts = [one for one in data.columns if pa.types.is_dictionary(one.type)]
    if (size := sum(map(_text_size, packed_texts))) > MOST_BYTES:
        raise _too_large(where, f"{size:,} bytes of text")
    return data.cast(schema)


def _text_size(column: Any) -> int:
    """Bytes of a column of dictionary-encoded text once it is expanded."""
    pa = optional_library("pyarrow")
    compute = optional_library("pyarrow.compute")

    total = 0
    for chunk in column.chunks:
        if not pa.types.is_string(chunk.dictionary.type):
            continue
        lengths = compute.binary_length(chunk.dictionary)
        total += compute.sum(lengths.take(chunk.indices).cast("int64")).as_py() or 0
    return total


def _too_large(where: str, found: str) -> InputError:
    return InputError(
        "the table is too large to be read at once",
        where=where,
        expected=f"at most {MOST_CELLS:,} values, and {MOST_BYTES:,} bytes unpacked",
        found=found,
        remedy="write only the columns or the laps that you need",
    )


def write_parquet(table: Table, path: Path) -> None:
    """Write a table so that `read_parquet` returns the same table."""
    pa = optional_library("pyarrow")
    parquet = optional_library("pyarrow.parquet")

    fields = [
        field.with_metadata(_metadata(table, field.name)) if _metadata(table, field.name) else field
        for field in table.data.schema
    ]
    columns = [table.data[name] for name in table.names]
    source = Path(table.where).name.encode("utf-8", "replace")
    lines = " ".join(f"{row}:{line}" for row, line in table.lines)
    schema = pa.schema(fields, {"source": source, "lines": lines, "decimal": table.decimal})
    with path.open("wb") as file:  # not by name: its bytes may be no text
        parquet.write_table(pa.table(columns, schema=schema), file)


def _metadata(table: Table, name: str) -> dict[str, str]:
    found: dict[str, Any] = {"unit": table.units.get(name), "clock": table.clocks.get(name)}
    return {key: value for key, value in found.items() if value}

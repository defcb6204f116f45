"""Tables in Parquet: those that others wrote, and the copies that a recording keeps.

A copy keeps every column as it was read, text included; units, and which time column belongs to
which column, stand in the metadata of the columns under "unit" and "clock".
"""

from pathlib import Path
from typing import Any

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.tables.table import Table, split_unit


def read_parquet(path: Path) -> Table:
    """Read a Parquet file; units come from the columns' metadata or stand behind their names."""
    pa = optional_library("pyarrow")
    parquet = optional_library("pyarrow.parquet")

    try:
        data = parquet.read_table(path)
    except (pa.ArrowException, OSError) as cause:
        raise InputError(
            "not a Parquet file that can be read",
            where=str(path),
            found=str(cause)[:200],
            remedy="was it written to its end? write it anew",
        ) from cause
    titles = [split_unit(name) for name in data.column_names]
    names = [name for name, _ in titles]
    if len(set(names)) < len(names):
        titles = [(name, "") for name in data.column_names]
    units = {name: unit for name, unit in titles if unit}
    clocks: dict[str, str] = {}
    for (name, _), column in zip(titles, data.schema, strict=True):
        metadata = column.metadata or {}
        units |= {name: metadata[b"unit"].decode()} if b"unit" in metadata else {}
        clocks |= {name: metadata[b"clock"].decode()} if b"clock" in metadata else {}
    where = (data.schema.metadata or {}).get(b"source", str(path).encode()).decode()
    return Table(where, data.rename_columns([name for name, _ in titles]), units, clocks)


def write_parquet(table: Table, path: Path) -> None:
    """Write a table so that `read_parquet` gives the same table again."""
    pa = optional_library("pyarrow")
    parquet = optional_library("pyarrow.parquet")

    fields = [
        field.with_metadata(_metadata(table, field.name)) if _metadata(table, field.name) else field
        for field in table.data.schema
    ]
    columns = [table.data[name] for name in table.names]
    schema = pa.schema(fields, {"source": Path(table.where).name})
    parquet.write_table(pa.table(columns, schema=schema), path)


def _metadata(table: Table, name: str) -> dict[str, str]:
    found: dict[str, Any] = {"unit": table.units.get(name), "clock": table.clocks.get(name)}
    return {key: value for key, value in found.items() if value}

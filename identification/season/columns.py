"""Columns of the index as an Arrow table, and entries as its rows."""

from collections.abc import Sequence
from dataclasses import asdict, fields
from typing import Any

from slipbench.identification.season.entry import Entry, Parameter
from slipbench.identification.season.folders import Folder
from slipbench.protocol.extras import optional_library

VERSION = "1"  # counts up where a column or its meaning changes: the index is then made anew
OF_FOLDER = ("path", "kind", "session", "run")
NUMBERS = {"gear": "int64", "engine_speed": "float64", "duration": "float64"}
NESTED = ("folder", "started", "tags", "parameters", "training", *NUMBERS)
TEXTS = tuple(one.name for one in fields(Entry) if one.name not in NESTED)


def schema() -> Any:
    """Arrow schema of the index."""
    pa = optional_library("pyarrow")
    text, real = pa.string(), pa.float64()
    parameter = [("name", text), ("unit", text), ("value", real), ("low", real), ("high", real)]
    tag = [("key", text), ("text", text), ("number", real), ("whole", pa.bool_())]
    stamp = [("name", text), ("time", pa.int64()), ("size", pa.int64())]
    return pa.schema(
        [
            *((name, text) for name in OF_FOLDER),
            ("stamp", pa.list_(pa.struct(stamp))),
            ("started", pa.timestamp("us")),
            *((name, text) for name in TEXTS),
            *((name, getattr(pa, of)()) for name, of in NUMBERS.items()),
            ("tags", pa.list_(pa.struct(tag))),
            ("parameters", pa.list_(pa.struct(parameter))),
            ("training", pa.list_(text)),
        ],
        metadata={"version": VERSION},
    )


def table_of(entries: Sequence[Entry]) -> Any:
    """Arrow table with a row for each entry, in their order."""
    pa = optional_library("pyarrow")
    return pa.Table.from_pylist([_row(one) for one in entries], schema=schema())


def entries_of(table: Any) -> list[Entry]:
    """Entries of an Arrow table that `table_of` made."""
    return [_entry(row) for row in table.to_pylist()]


def _row(entry: Entry) -> dict[str, Any]:
    folder = entry.folder
    return {
        **{name: getattr(folder, name) for name in OF_FOLDER},
        **{name: getattr(entry, name) for name in (*TEXTS, *NUMBERS, "started")},
        "stamp": [dict(zip(("name", "time", "size"), one, strict=True)) for one in folder.stamp],
        "tags": [_tag(key, value) for key, value in entry.tags],
        "parameters": [asdict(one) for one in entry.parameters],
        "training": list(entry.training),
    }


def _tag(key: str, value: int | float | str) -> dict[str, Any]:
    known = not isinstance(value, str)
    return {
        "key": key,
        "text": str(value),
        "number": float(value) if known else None,
        "whole": isinstance(value, int),
    }


def _entry(row: dict[str, Any]) -> Entry:
    stamp = tuple((one["name"], one["time"], one["size"]) for one in row["stamp"])
    return Entry(
        folder=Folder(**{name: row[name] for name in OF_FOLDER}, stamp=stamp),
        tags=tuple((one["key"], _value(one)) for one in row["tags"]),
        parameters=tuple(Parameter(**one) for one in row["parameters"]),
        training=tuple(row["training"]),
        **{name: row[name] for name in (*TEXTS, *NUMBERS, "started")},
    )


def _value(tag: dict[str, Any]) -> int | float | str:
    if tag["number"] is None:
        return str(tag["text"])
    return int(tag["number"]) if tag["whole"] else float(tag["number"])

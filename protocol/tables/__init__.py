"""Read tables of samples, as loggers and data systems export them.

table = read_table(Path("gps.csv"))
speed = samples(table, "Speed", "", TableRules())   # times in s, values, unit
"""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.formats import FORMATS, looks_like, read_head, refusal
from slipbench.protocol.tables.csv_file import holds_table, read_csv
from slipbench.protocol.tables.long_table import by_channel, holds_text, long_columns
from slipbench.protocol.tables.parquet_file import read_parquet, write_parquet
from slipbench.protocol.tables.samples import Samples, samples
from slipbench.protocol.tables.table import Table

__all__ = ["Samples", "Table", "is_table", "read_table", "samples", "write_parquet"]

# Module here and its function that read a format; imported when a file of it is read.
READERS = {
    "mf4": "mdf_file.read_mdf",
    "vbo": "vbo_file.read_vbo",
    "gpx": "gpx_file.read_gpx",
    "mcap": "mcap_file.read_mcap",
    "ros1-bag": "ros_bag.read_ros1_bag",
    "sqlite": "ros_bag.read_ros2_bag",
    "fit": "fit_file.read_fit",
    "xrk": "xrk_file.read_xrk",
    "xrz": "xrk_file.read_xrk",
}
LOOKED_AT = 1 << 16  # bytes in which the numbers of a table must begin


def read_table(path: Path) -> Table:
    """Table of a file of any format of samples, recognized by its content.

    Raises InputError where the file holds no table, is damaged or of another format.
    """
    form = looks_like(read_head(path))
    if form == "parquet":
        return _wide(read_parquet(path))
    if form is None or form == "motec-csv":
        return read_csv(path)
    if form in READERS:
        module, _, function = READERS[form].partition(".")
        read: Callable[[Path], Table] = getattr(import_module(f"{__name__}.{module}"), function)
        return read(path)
    if FORMATS[form].refused:
        raise refusal(form, path)
    raise InputError(
        f"this is a log of frames ({FORMATS[form].title}), not a table",
        where=str(path),
        remedy="give it as the log, not with --table",
    )


def _wide(table: Table) -> Table:
    """Table with a column for each channel, also of one that has a row for each sample."""
    long = long_columns(table.names)
    return by_channel(table, long) if long and holds_text(table, long.names[-1]) else table


def is_table(path: Path) -> bool:
    """Whether the file is a table, not a log of frames, by content. Raises InputError."""
    form = looks_like(read_head(path))
    if form == "mf4":
        from slipbench.protocol.logs.through_asammdf import has_raw_frames, opened

        with opened(path) as mdf:
            return not has_raw_frames(mdf)
    if form is not None:
        return FORMATS[form].reader == "table"
    return path.suffix.casefold() in (".csv", ".tsv") or holds_table(read_head(path, LOOKED_AT))

"""Read XRK and XRZ files, the logs of AiM loggers. Decoded by libxrk.

Channels that were sampled at the same times share a time column. Times are in s since the first
sample of the log.
"""

import os
import re
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.tables.groups import Group, table_of_groups
from slipbench.protocol.tables.table import Table
from slipbench.protocol.units import is_unit
from slipbench.protocol.user_file import read_user_file

LARGEST = 1 << 30  # bytes, unpacked
ZLIB = b"\x78"
PARSER = "libxrk._aim_xrk_rs"
"""libxrk's parser in Rust. The one that `libxrk.aim_xrk` takes unless an environment variable is set
before the first import fails for a log without satellite positions, and is not safe for damaged ones."""
# Units that libxrk writes in its own way. A lambda has none.
UNITS = {"C": "degC", "g": "standard_gravity", "lambda": ""}
_SKIPPED = re.compile(r"Bad bytes\((\d+) at \d+\)")


def read_xrk(path: Path) -> Table:
    """Table of the channels of an AiM log, those of one time base with a common time column.

    What is damaged is left out, and a warning states how much. Raises InputError where no channel can
    be read.
    """
    content, warnings = _unpacked(read_user_file(path, LARGEST), path)
    try:
        with _messages_of_library() as said:
            log = optional_library(PARSER).aim_xrk(content)
    except InputError:
        raise
    except Exception as cause:  # libxrk passes on any exception of its parsing
        raise _unreadable(path, f"{type(cause).__name__}: {cause}"[:200]) from cause
    groups = _groups(log)
    if not groups:
        raise _unreadable(path, "no channel with samples")
    count = sum(len(group.channels) for group in groups)
    layout = f"AiM log, decoded by libxrk: {count} channels; times since the first sample"
    return table_of_groups(str(path), groups, (layout,), (*warnings, *_damage(path, said)))


def _unpacked(content: bytes, path: Path) -> tuple[bytes, tuple[str, ...]]:
    """Content of an XRZ file, and a warning where it breaks off; of an XRK file as it is."""
    if not content.startswith(ZLIB):
        return content, ()
    unpacker = zlib.decompressobj()
    try:
        unpacked = unpacker.decompress(content, LARGEST)
    except zlib.error as cause:
        raise _unreadable(path, str(cause)) from cause
    if unpacker.unconsumed_tail:
        raise _unreadable(path, f"more than {LARGEST:,} bytes, unpacked")
    return unpacked, () if unpacker.eof else (f"{path}: broken off: read up to its end",)


def _unreadable(path: Path, found: str) -> InputError:
    return InputError(
        "no channels in this AiM log",
        where=str(path),
        expected="an .xrk or .xrz file with samples",
        found=found,
        remedy="copy the file whole from the logger, or export it from RaceStudio as CSV",
    )


@contextmanager
def _messages_of_library() -> Iterator[list[str]]:
    """Lines that the library writes to the process's standard error, which it has no other way of."""
    lines: list[str] = []
    with tempfile.TemporaryFile() as file:
        kept = os.dup(2)
        os.dup2(file.fileno(), 2)
        try:
            yield lines
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            file.seek(0)
            lines += file.read().decode("utf-8", "replace").splitlines()


def _damage(path: Path, said: list[str]) -> Iterator[str]:
    """Sentence about the parts that could not be read."""
    skipped = [int(found[1]) for line in said if (found := _SKIPPED.match(line))]
    if skipped:
        yield (
            f"{path}: damaged or broken off: {sum(skipped)} bytes in {len(skipped)}"
            f" place{'s' if len(skipped) != 1 else ''} are not"
            " read, and the samples in them are missing"
        )


def _groups(log: Any) -> list[Group]:
    """Channels by name, those with the same times in one group."""
    times: dict[bytes, Any] = {}
    channels: dict[bytes, dict[str, tuple[Any, str]]] = {}
    for name in sorted(log.channels):
        table = log.channels[name]
        milliseconds = np.asarray(table.column("timecodes").to_numpy(), np.int64)
        if milliseconds.size:
            base = milliseconds.tobytes()
            times.setdefault(base, 1e-3 * milliseconds)
            unit = _unit(table.schema.field(name).metadata or {})
            channels.setdefault(base, {})[name] = (table.column(name).to_numpy(), unit)
    return [Group(times[base], of_base) for base, of_base in channels.items()]


def _unit(metadata: Any) -> str:
    written = bytes(metadata.get(b"units", b"")).decode("utf-8", "replace")
    unit = UNITS.get(written, written)
    return unit if unit and is_unit(unit) else ""

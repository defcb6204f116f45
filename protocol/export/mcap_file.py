"""A recording as MCAP: a topic a bus of raw frames, a topic a message of decoded ones, as JSON.

    /can0/frames         {"id", "extended", "fd", "fd_flags", "sent", "data" (base64)}
    /can0/EngineStatus   {signal: value in the database's unit, ...}; the schema names the units

All messages stand in one order of time, which readers that follow a log rely on.
"""

import base64
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipbench.protocol.database.layout import Database, Message
from slipbench.protocol.export.lengths import fd_flags
from slipbench.protocol.extras import optional_library
from slipbench.protocol.logs.decode import Samples, SortedLog, sort_log
from slipbench.protocol.logs.frame_log import FrameLog

if TYPE_CHECKING:
    from mcap.writer import Writer

AT_ONCE = 100_000  # frames held decoded in memory
_FRAME = {
    "id": {"type": "integer"},
    "extended": {"type": "boolean"},
    "fd": {"type": "boolean"},
    "fd_flags": {"type": "integer"},
    "sent": {"type": "boolean"},
    "data": {"type": "string", "contentEncoding": "base64"},
}


def write_mcap(portions: Iterator[SortedLog], database: Database, path: Path) -> int:
    """Write frames and decoded messages; returns the number of decoded samples."""
    mcap = optional_library("mcap.writer")

    first = samples = 0
    with path.open("wb") as file:
        writer = mcap.Writer(file, compression=mcap.CompressionType.LZ4)
        writer.start(profile="", library="slipbench")
        channels = _Channels(writer)
        for log in (portion.log for portion in portions):
            for begin in range(0, len(log), AT_ONCE):
                piece = log.select(np.arange(begin, min(begin + AT_ONCE, len(log))))
                samples += _write_piece(writer, channels, piece, database, first)
                first += len(piece)
        writer.finish()
    return samples


def _write_piece(
    writer: "Writer", channels: "_Channels", log: FrameLog, database: Database, first: int
) -> int:
    """Write some frames and what they decode to; numbered from `first`."""
    decoded, samples = _decoded(sort_log(log, database), len(log))
    write = writer.add_message
    for row, (time, bus, frame) in enumerate(_frames(log)):
        write(channels.frames(log.buses[bus]), time, frame, time, first + row)
        if (found := decoded[row]) is not None:
            message, text = found
            channel = channels.message(log.buses[bus], message)
            write(channel, time, text.encode("ascii"), time, first + row)
    return samples


class _Channels:
    """Topics, registered when their first message comes."""

    def __init__(self, writer: "Writer") -> None:
        self._writer = writer
        self._known: dict[tuple[str, str], int] = {}

    def frames(self, bus: str) -> int:
        return self._known.get((bus, "frames")) or self._channel(bus, "frames", _FRAME)

    def message(self, bus: str, message: Message) -> int:
        if (bus, message.name) in self._known:
            return self._known[bus, message.name]
        signals = {
            signal.name: {"type": "number", "description": signal.unit}
            for signal in message.signals
        }
        return self._channel(bus, message.name, signals)

    def _channel(self, bus: str, name: str, properties: dict[str, Any]) -> int:
        schema = json.dumps({"type": "object", "properties": properties}).encode()
        number = self._writer.register_schema(name, "jsonschema", schema)
        channel = self._writer.register_channel(f"/{bus}/{name}", "json", number)
        self._known[bus, name] = channel
        return channel


def _frames(log: FrameLog) -> Iterator[tuple[int, int, bytes]]:
    """Give time, bus and text of every frame."""
    payload, width = log.data.tobytes(), log.data.shape[1]
    columns = (
        log.time_ns,
        log.bus,
        log.identifier,
        log.extended,
        log.fd,
        fd_flags(log),
        log.sent,
        log.length,
    )
    rows = zip(*(column.tolist() for column in columns), strict=True)
    truth = ("false", "true")
    for row, (time, bus, identifier, extended, fd, flags, sent, length) in enumerate(rows):
        data = base64.b64encode(payload[row * width : row * width + length]).decode("ascii")
        text = (
            f'{{"id":{identifier},"extended":{truth[extended]},"fd":{truth[fd]},'
            f'"fd_flags":{flags},"sent":{truth[sent]},"data":"{data}"}}'
        )
        yield time, bus, text.encode("ascii")


def _decoded(sorted_log: SortedLog, count: int) -> tuple[list[tuple[Message, str] | None], int]:
    """Give each frame's message and its values as JSON, None where not known; and the samples."""
    found: list[tuple[Message, str] | None] = [None] * count
    samples = 0
    for frames in sorted_log.frames.values():
        texts: list[list[str]] = [[] for _ in range(len(frames))]
        for signal in frames.message.signals:
            name, held = json.dumps(signal.name), frames.samples(signal.name)
            places = np.searchsorted(frames.rows, held.rows).tolist()
            for place, value in zip(places, _values(held), strict=True):
                texts[place].append(f"{name}:{value}")
            samples += len(places)
        for row, values in zip(frames.rows.tolist(), texts, strict=True):
            found[row] = frames.message, "{" + ",".join(values) + "}"
    return found, samples


def _values(samples: Samples) -> list[str]:
    """Values as JSON; NaN and infinities, which JSON lacks, as null."""
    texts = list(map(repr, samples.exact.tolist()))
    for row in np.flatnonzero(~np.isfinite(samples.value.astype(np.float64))).tolist():
        texts[row] = "null"
    return texts

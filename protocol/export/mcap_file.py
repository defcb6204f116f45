"""Export as MCAP: one topic per bus of raw frames, one per message of decoded values, as JSON.

    /can0/frames         {"id", "extended", "fd", "fd_flags", "sent", "data" (base64)}
    /can0/EngineStatus   {signal: value in the database's unit, ...}: json_messages.py has the schema

All messages stand in one order of time, which readers that follow a log rely on.
"""

import base64
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipbench.protocol.database.layout import Database, Message
from slipbench.protocol.export.json_messages import (
    json_messages,
    message_schema,
    object_schema,
    topic_of,
)
from slipbench.protocol.export.lengths import fd_flags
from slipbench.protocol.extras import optional_library
from slipbench.protocol.logs.decode import SortedLog, sort_log
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
_FRAMES = object_schema("frames", "Raw frames of a bus, as recorded", _FRAME)


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
    """Write some frames, numbered from `first`, and their decoded values."""
    decoded, samples = json_messages(sort_log(log, database))
    write = writer.add_message
    for row, (time, bus, frame) in enumerate(_frames(log)):
        write(channels.frames(log.buses[bus]), time, frame, time, first + row)
        if (found := decoded[row]) is not None:
            message, text = found
            channel = channels.message(log.buses[bus], message)
            write(channel, time, text, time, first + row)
    return samples


class _Channels:
    """Topics, registered when their first message comes."""

    def __init__(self, writer: "Writer") -> None:
        self._writer = writer
        self._known: dict[tuple[str, str], int] = {}

    def frames(self, bus: str) -> int:
        return self._known.get((bus, "frames")) or self._channel(bus, "frames", _FRAMES)

    def message(self, bus: str, message: Message) -> int:
        known = self._known.get((bus, message.name))
        return known or self._channel(bus, message.name, message_schema(message))

    def _channel(self, bus: str, name: str, tree: dict[str, Any]) -> int:
        schema = json.dumps(tree).encode()
        number = self._writer.register_schema(name, "jsonschema", schema)
        channel = self._writer.register_channel(topic_of(bus, name), "json", number)
        self._known[bus, name] = channel
        return channel


def _frames(log: FrameLog) -> Iterator[tuple[int, int, bytes]]:
    """Time, bus and text of every frame."""
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

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

from protocol.decode import Frames, SortedLog, sort_log
from protocol.export.lengths import fd_flags
from protocol.frame_log import FrameLog
from protocol.layout import Database, Message

if TYPE_CHECKING:
    from mcap.writer import Writer

AT_ONCE = 100_000  # frames held decoded in memory
_FRAME = {
    "id": {"type": "integer"}, "extended": {"type": "boolean"}, "fd": {"type": "boolean"},
    "fd_flags": {"type": "integer"}, "sent": {"type": "boolean"},
    "data": {"type": "string", "contentEncoding": "base64"},
}  # fmt: skip


def write_mcap(sorted_log: SortedLog, database: Database, path: Path) -> int:
    """Write frames and decoded messages; returns the number of decoded samples."""
    from mcap.writer import CompressionType, Writer

    log = sorted_log.log
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.LZ4)
        writer.start(profile="", library="slipbench")
        channels = _Channels(writer, log)
        samples = sum(
            _write_piece(writer, channels, log.select(np.arange(first, last)), database, first)
            for first in range(0, len(log), AT_ONCE)
            if (last := min(first + AT_ONCE, len(log)))
        )
        writer.finish()  # type: ignore[no-untyped-call]
    return samples


def _write_piece(
    writer: "Writer", channels: "_Channels", log: FrameLog, database: Database, first: int
) -> int:
    """Write some frames and what they decode to; numbered from `first`."""
    decoded, samples = _decoded(sort_log(log, database)), 0
    for row, (time, bus, text) in enumerate(_frames(log)):
        writer.add_message(channels.frames(bus), time, text, time, first + row)
        if row in decoded:
            message, values = decoded[row]
            samples += len(values)
            told = json.dumps(values).encode()
            writer.add_message(channels.message(bus, message), time, told, time, first + row)
    return samples


class _Channels:
    """Topics, registered when their first message comes."""

    def __init__(self, writer: "Writer", log: FrameLog) -> None:
        self._writer, self._buses = writer, log.buses
        self._known: dict[tuple[int, str], int] = {}

    def frames(self, bus: int) -> int:
        return self._channel(bus, "frames", _FRAME)

    def message(self, bus: int, message: Message) -> int:
        if (bus, message.name) in self._known:
            return self._known[bus, message.name]
        signals = {
            signal.name: {"type": "number", "description": signal.unit}
            for signal in message.signals
        }
        return self._channel(bus, message.name, signals)

    def _channel(self, bus: int, name: str, properties: dict[str, Any]) -> int:
        if (bus, name) not in self._known:
            schema = json.dumps({"type": "object", "properties": properties}).encode()
            number = self._writer.register_schema(name, "jsonschema", schema)
            topic = f"/{self._buses[bus]}/{name}"
            self._known[bus, name] = self._writer.register_channel(topic, "json", number)
        return self._known[bus, name]


def _frames(log: FrameLog) -> Iterator[tuple[int, int, bytes]]:
    """Give time, bus and text of every frame."""
    payload, width = log.data.tobytes(), log.data.shape[1]
    columns = (
        log.time_ns, log.bus, log.identifier, log.extended, log.fd, fd_flags(log), log.sent,
        log.length,
    )  # fmt: skip
    rows = zip(*(column.tolist() for column in columns), strict=True)
    truth = ("false", "true")
    for row, (time, bus, identifier, extended, fd, flags, sent, length) in enumerate(rows):
        data = base64.b64encode(payload[row * width : row * width + length]).decode("ascii")
        text = (
            f'{{"id":{identifier},"extended":{truth[extended]},"fd":{truth[fd]},'
            f'"fd_flags":{flags},"sent":{truth[sent]},"data":"{data}"}}'
        )
        yield time, bus, text.encode("ascii")


def _decoded(sorted_log: SortedLog) -> dict[int, tuple[Message, dict[str, float]]]:
    """Give each decoded frame's values by its row; NaN and infinities become null."""
    found: dict[int, tuple[Message, dict[str, Any]]] = {}
    for frames in sorted_log.frames.values():
        for row in frames.rows.tolist():
            found[row] = (frames.message, {})
        _fill(frames, found)
    return found


def _fill(frames: Frames, found: dict[int, tuple[Message, dict[str, Any]]]) -> None:
    for signal in frames.message.signals:
        samples = frames.samples(signal.name)
        finite = np.isfinite(samples.value.astype(np.float64)).tolist()
        values = samples.value.tolist()
        for row, value, known in zip(samples.rows.tolist(), values, finite, strict=True):
            found[row][1][signal.name] = value if known else None

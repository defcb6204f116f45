"""Read MCAP files: messages in JSON and of ROS, each topic with its own times."""

import json
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from io import BufferedReader
from pathlib import Path
from typing import Any

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.tables.ros_types import Decode, ros_decoder
from slipbench.protocol.tables.table import Table
from slipbench.protocol.tables.topics import MOST_DEPTH, About, Topics
from slipbench.protocol.units import is_unit
from slipbench.protocol.user_file import open_user_file

LIMIT = 1 << 30  # bytes of one record
LARGEST_CHUNK = 1 << 28  # bytes, unpacked; writers make chunks of some megabytes


def read_mcap(path: Path) -> Table:
    """Table of the numbers of every message. A damaged file is read up to the damage.

    Raises InputError where no message with a number can be read.
    """
    topics = Topics(str(path))
    warnings: list[str] = []
    try:
        with open_user_file(path) as file:
            _read(file, topics)
    except InputError:
        raise
    except Exception as cause:  # mcap passes on any exception of its parsing
        damage = f"{type(cause).__name__}: {cause}"[:200]
        warnings.append(
            f"{path}: damaged or broken off: {damage}; {topics.count} messages before it are read"
        )
    return topics.table("MCAP", warnings)


def _read(file: BufferedReader, topics: Topics) -> None:
    """Add all messages in the order of the file, which needs no index at its end."""
    decoders = _Decoders()
    schemas: dict[int, Any] = {}
    channels: dict[int, Any] = {}
    for record in _records(file):
        kind = type(record).__name__
        if kind == "Schema":
            schemas[record.id] = record
        elif kind == "Channel":
            channels[record.id] = record
        elif kind == "Message":
            channel = channels[record.channel_id]
            _add(topics, decoders, schemas.get(channel.schema_id), channel, record)


def _add(topics: Topics, decoders: "_Decoders", schema: Any, channel: Any, message: Any) -> None:
    """Decode one message; one that cannot be decoded is counted with the reason."""
    decode = decoders.of(schema, channel)
    if decode is None:
        topics.skip(channel.topic, f"encoding {channel.message_encoding!r}")
        return
    try:
        decoded = decode(message.data)
    except Exception as cause:  # whatever a damaged or foreign message makes
        topics.skip(channel.topic, f"cannot be decoded ({type(cause).__name__})")
        return
    topics.add(channel.topic, message.log_time, decoded, _about(schema))


def _records(file: BufferedReader) -> Iterator[Any]:
    """Records of a file, those in chunks as well. A chunk is unpacked to at most LARGEST_CHUNK."""
    stream = optional_library("mcap.stream_reader")

    reader = stream.StreamReader(
        file, emit_chunks=True, validate_crcs=True, record_size_limit=LIMIT
    )
    for record in reader.records:
        if type(record).__name__ != "Chunk":
            yield record
            continue
        plain = replace(record, compression="", data=_unpacked(record, stream))
        yield from stream.breakup_chunk(plain, validate_crc=True)


def _unpacked(chunk: Any, stream: Any) -> bytes:
    """Content of a chunk. Raises InputError before more than LARGEST_CHUNK is in memory."""
    most = LARGEST_CHUNK + 1
    if chunk.compression == "lz4":
        data = stream.lz4.LZ4FrameDecompressor().decompress(chunk.data, max_length=most)
    elif chunk.compression == "zstd":
        packed = stream.zstandard.ZstdDecompressor()
        with packed.stream_reader(chunk.data) as reader:
            data = reader.read(most)
    elif chunk.compression == "":
        data = chunk.data
    else:
        raise ValueError(f"compression {chunk.compression!r}")
    if len(data) >= most:
        raise InputError(
            "a chunk of this file unpacks to more than can be read at once",
            expected=f"at most {LARGEST_CHUNK:,} bytes",
            remedy="write it again with smaller chunks: mcap compress --chunk-size",
        )
    return bytes(data)


class _Decoders:
    """Functions that decode the messages of a channel, by its schema."""

    def __init__(self) -> None:
        self._known: dict[tuple[int, str], Decode | None] = {}

    def of(self, schema: Any, channel: Any) -> Decode | None:
        """Decoder of a channel; None for an encoding that is not read."""
        if channel.message_encoding == "json":
            return json.loads
        if schema is None:
            return None
        key = schema.id, channel.message_encoding
        if key not in self._known:
            self._known[key] = self._made(schema, channel.message_encoding)
        return self._known[key]

    def _made(self, schema: Any, encoding: str) -> Decode | None:
        try:
            text = schema.data.decode("utf-8")
            return ros_decoder(schema.name, schema.encoding, text, encoding)
        except InputError:
            raise
        except Exception:  # a damaged or foreign definition; its messages are counted as not read
            return None


def _about(schema: Any) -> About:
    if schema is None:
        return About()
    return _known(schema.name, schema.encoding, schema.data)


@lru_cache(maxsize=1024)
def _known(name: str, encoding: str, definition: bytes) -> About:
    """Content of a schema: the type of ROS, or the units of a JSON schema."""
    if encoding != "jsonschema":
        return About(name)
    try:
        schema = json.loads(definition)
    except ValueError:
        return About()
    return About("", dict(_units(schema, "", 0)))


def _units(schema: Any, path: str, depth: int) -> Iterator[tuple[str, str]]:
    """Units by path, of the properties that have one: as `unit`, or as their description."""
    properties = schema.get("properties") if isinstance(schema, dict) else None
    if not isinstance(properties, dict) or depth >= MOST_DEPTH:
        return
    for name, held in properties.items():
        inner = f"{path}.{name}".lstrip(".")
        stated = held if isinstance(held, dict) else {}
        text = stated.get("unit", stated.get("description"))
        if isinstance(text, str) and text.strip() and is_unit(text.strip()):
            yield inner, text.strip()
        yield from _units(held, inner, depth + 1)

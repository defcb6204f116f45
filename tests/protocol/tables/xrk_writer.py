"""Write AiM XRK files: a configuration with channels, then their samples."""

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

FLOAT, INTEGER = 6, 4  # decoders of a sample: 32-bit float, 16-bit integer
PACKED = {FLOAT: "<f", INTEGER: "<h"}


@dataclass(frozen=True)
class Channel:
    """name: at most 23 letters. unit: AiM's number of it. samples: (time in ms, value)."""

    name: str
    unit: int
    samples: Sequence[tuple[int, float]]
    decoder: int = FLOAT

    @property
    def size(self) -> int:
        return struct.calcsize(PACKED[self.decoder])


def message(token: str, content: bytes, checksum: int | None = None) -> bytes:
    """A message with its header and its footer. checksum: None for the right one."""
    name = token.encode().ljust(4, b" ")
    total = sum(content) & 0xFFFF if checksum is None else checksum
    return (
        b"<h" + name + struct.pack("<iB", len(content), 1) + b">" + content
        + b"<" + name + struct.pack("<H", total) + b">"
    )  # fmt: skip


def description(index: int, channel: Channel) -> bytes:
    """Message that describes a channel."""
    content = bytearray(112)
    struct.pack_into("<H", content, 0, index)
    content[12], content[20], content[72] = channel.unit, channel.decoder, channel.size
    content[24 : 24 + 7] = f"CH{index:05d}".encode()
    content[32 : 32 + len(channel.name)] = channel.name.encode()
    return message("CHS", bytes(content))


def xrk(channels: Sequence[Channel]) -> bytes:
    """A whole file, the samples in the order of time."""
    descriptions = b"".join(description(i, c) for i, c in enumerate(channels))
    return message("CNF", descriptions) + b"".join(samples(channels))


def samples(channels: Sequence[Channel]) -> Iterable[bytes]:
    every = sorted((t, i, v) for i, c in enumerate(channels) for t, v in c.samples)
    for time, index, value in every:
        decoder = channels[index].decoder
        number = round(value) if decoder == INTEGER else value
        yield b"(S" + struct.pack("<iH", time, index) + struct.pack(PACKED[decoder], number) + b")"

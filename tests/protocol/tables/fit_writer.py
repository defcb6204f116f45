"""A writer of small FIT files, made from the published layout; it shares no code with the reader."""

import struct
from collections.abc import Sequence

EPOCH = 631_065_600  # s since 1970, at 1989-12-31
_NIBBLES = [
    0x0000, 0xCC01, 0xD801, 0x1400, 0xF001, 0x3C00, 0x2800, 0xE401,
    0xA001, 0x6C00, 0x7800, 0xB401, 0x5000, 0x9C01, 0x8801, 0x4400,
]  # fmt: skip
# Number, size and base type of the fields of message 20, "record".
FIELDS = ((253, 4, 0x86), (0, 4, 0x85), (1, 4, 0x85), (6, 2, 0x84), (13, 1, 0x01))
INVALID_SPEED = 0xFFFF


def crc(data: bytes) -> int:
    value = 0
    for byte in data:
        for nibble in (byte & 0xF, byte >> 4):
            value = (value >> 4) ^ _NIBBLES[value & 0xF] ^ _NIBBLES[nibble]
    return value


def fit(rows: Sequence[tuple[float, float, float, float | None, int]]) -> bytes:
    """File of records: time (s since 1970), latitude and longitude (deg), speed (m/s), temperature."""
    body = struct.pack("<BBBHB", 0x40, 0, 0, 20, len(FIELDS))
    body += b"".join(bytes(field) for field in FIELDS)
    for time, latitude, longitude, speed, temperature in rows:
        body += struct.pack(
            "<BIiiHb",
            0,
            round(time) - EPOCH,
            round(latitude / 180 * 2**31),
            round(longitude / 180 * 2**31),
            INVALID_SPEED if speed is None else round(speed * 1000),
            temperature,
        )
    head = struct.pack("<BBHI4s", 14, 0x20, 2140, len(body), b".FIT")
    head += struct.pack("<H", crc(head))
    return head + body + struct.pack("<H", crc(head + body))

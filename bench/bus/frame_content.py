"""Signals of a single frame: read a value, write a value, protect the payload again.

For whole logs see `protocol/logs/decode.py`, for the bench's own messages `protocol/codec`. This file
takes any message of any database, in either byte order.
"""

import struct

from slipbench.protocol.codec.protection import Bits, bits_of, guard_of
from slipbench.protocol.codec.slot import FLOATS
from slipbench.protocol.database.layout import Message, Signal


def raw_value(signal: Signal, data: bytes) -> int | float:
    """Raw value of a signal in a payload. Raises ValueError where the payload is too short."""
    word = _bits(signal, len(data)).read(data)
    if signal.is_float:
        form = FLOATS[signal.length]
        return float(struct.unpack(form, word.to_bytes(signal.length // 8, "little"))[0])
    if signal.signed and word >> (signal.length - 1):
        return word - (1 << signal.length)
    return word


def with_raw(signal: Signal, data: bytes, raw: int | float) -> bytes:
    """Payload with another raw value of a signal; all other bits are as before.

    An integer is taken modulo its width. Raises ValueError where the payload is too short.
    """
    if signal.is_float:
        bits = int.from_bytes(struct.pack(FLOATS[signal.length], raw), "little")
    else:
        bits = int(raw)
    payload = bytearray(data)
    _bits(signal, len(data)).write(payload, bits)
    return bytes(payload)


def physical(signal: Signal, raw: int | float) -> float:
    """Physical value of a raw value, in the database's unit."""
    return raw * signal.scale + signal.offset


def raw_of(signal: Signal, value: float) -> int | float:
    """Raw value nearest to a physical value (database's unit).

    A running count or a clock wraps. Raises ValueError where the signal cannot hold the value.
    """
    raw = (value - signal.offset) / signal.scale
    if signal.is_float:
        return raw
    low, high = signal.raw_range
    number = round(raw)
    if signal.wraps:
        return number % (1 << signal.length)
    if not low <= number <= high:
        ends = sorted(physical(signal, end) for end in (low, high))
        raise ValueError(f"{signal.name} = {value:g} is not in {ends[0]:g} to {ends[1]:g}")
    return number


def value_in(message: Message, signal: Signal, data: bytes) -> float | None:
    """Physical value of a signal in a frame, in the database's unit; None where it holds none.

    That is so where the frame is too short, or its multiplexer selects other signals.
    """
    if len(data) < message.length:
        return None
    if signal.multiplexer is not None:
        selector = message.signal(signal.multiplexer)
        if raw_value(selector, data) not in signal.multiplexer_ids:
            return None
    return physical(signal, raw_value(signal, data))


def counter_in(message: Message, data: bytes) -> int | None:
    """Counter of a protected frame; None where the message has none, or the frame is too short."""
    guard = guard_of(message)
    if guard is None or len(data) < message.length:
        return None
    return guard.counter(data[: message.length])


def crc_correct(message: Message, data: bytes) -> bool:
    """Whether the checksum of a frame is correct; True where the message has no protection."""
    guard = guard_of(message)
    return guard is None or guard.intact(bytearray(data[: message.length]))


def protect(message: Message, data: bytes, counter: int | None = None) -> bytes:
    """Payload with its checksum computed anew, and with another counter unless that is None.

    The payload itself where the message has no protection.
    """
    guard = guard_of(message)
    if guard is None:
        return data
    payload = bytearray(data[: message.length])
    kept = (guard.counter(payload) or 0) if counter is None else counter
    guard.protect(payload, kept % guard.period if guard.period else 0)
    return bytes(payload) + data[message.length :]


def _bits(signal: Signal, length: int) -> Bits:
    """Bits of a signal in a payload of `length` bytes. Raises ValueError where it ends beyond."""
    end = signal.first_bit + signal.length
    if end > 8 * length:
        raise ValueError(f"{signal.name} ends at bit {end}, the payload has {8 * length}")
    return bits_of(signal, length)

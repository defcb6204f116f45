"""Protection of a message on the wire: AUTOSAR E2E profiles, or a plain counter and checksum.

Source of the profiles: AUTOSAR, Specification of SW-C End-to-End Communication Protection Library.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt
from e2e.p02 import e2e_p02_check, e2e_p02_protect
from e2e.p05 import e2e_p05_check, e2e_p05_protect

from slipbench.protocol.codec import e2e
from slipbench.protocol.codec.checksum import checksum, checksums
from slipbench.protocol.database.layout import Checksum, Message, Protection, Signal
from slipbench.protocol.errors import InputError

Bytes = npt.NDArray[np.uint8]
Flags = npt.NDArray[np.bool_]


class Guard(Protocol):
    """Protection of one message. Payloads have the length of the message."""

    @property
    def period(self) -> int:
        """Number of values of the counter; 0 where there is no counter."""

    def protect(self, payload: bytearray, counter: int) -> None:
        """Write counter and checksum into a payload, in place."""

    def intact(self, payload: bytearray) -> bool:
        """Whether checksum and data id are those of the content."""

    def counter(self, payload: bytes | bytearray) -> int | None:
        """Counter of a payload; None where there is none."""

    def all_intact(self, data: Bytes) -> Flags:
        """`intact` of n payloads. data: (n, length); returns (n,)."""

    def counters(self, data: Bytes) -> npt.NDArray[np.int64]:
        """Counters of n payloads. data: (n, length); returns (n,)."""


@dataclass(frozen=True)
class Profile1:
    """E2E profile 1: CRC-8 in byte 0, counter 0..14 in the low nibble of byte 1."""

    data_id: int
    period: int = e2e.PERIOD

    def protect(self, payload: bytearray, counter: int) -> None:
        """Write counter and CRC into a payload, in place."""
        e2e.protect(payload, self.data_id, counter)

    def intact(self, payload: bytearray) -> bool:
        """Whether the CRC is right; a counter of 15 is not valid."""
        return e2e.crc_is_right(payload, self.data_id)

    def counter(self, payload: bytes | bytearray) -> int | None:
        """Counter of a payload."""
        return payload[1] & 0x0F

    def all_intact(self, data: Bytes) -> Flags:
        """`intact` of n payloads. data: (n, length); returns (n,)."""
        return e2e.rightly_protected(data, self.data_id)

    def counters(self, data: Bytes) -> npt.NDArray[np.int64]:
        """Counters of n payloads. data: (n, length); returns (n,)."""
        return (data[:, 1] & 0x0F).astype(np.int64)


@dataclass(frozen=True)
class Profile2:
    """E2E profile 2: CRC-8H2F in byte 0, counter 0..15 in byte 1; it selects one of 16 data ids."""

    data_ids: bytes
    period: int = 16

    def protect(self, payload: bytearray, counter: int) -> None:
        """Write counter and CRC into a payload, in place."""
        payload[1] = (payload[1] & 0xF0) | counter
        e2e_p02_protect(payload, self.data_ids, increment_counter=False)

    def intact(self, payload: bytearray) -> bool:
        """Whether the CRC is right."""
        return bool(e2e_p02_check(payload, self.data_ids))

    def counter(self, payload: bytes | bytearray) -> int | None:
        """Counter of a payload."""
        return payload[1] & 0x0F

    def all_intact(self, data: Bytes) -> Flags:
        """`intact` of n payloads. data: (n, length); returns (n,)."""
        return np.array([self.intact(bytearray(row)) for row in data], np.bool_)

    def counters(self, data: Bytes) -> npt.NDArray[np.int64]:
        """Counters of n payloads. data: (n, length); returns (n,)."""
        return (data[:, 1] & 0x0F).astype(np.int64)


@dataclass(frozen=True)
class Profile5:
    """E2E profile 5: CRC-16 in bytes 0 and 1, counter 0..255 in byte 2."""

    data_id: int
    period: int = 256

    def protect(self, payload: bytearray, counter: int) -> None:
        """Write counter and CRC into a payload, in place."""
        payload[2] = counter
        e2e_p05_protect(payload, self.data_id, increment_counter=False)

    def intact(self, payload: bytearray) -> bool:
        """Whether the CRC is right."""
        return bool(e2e_p05_check(payload, self.data_id))

    def counter(self, payload: bytes | bytearray) -> int | None:
        """Counter of a payload."""
        return payload[2]

    def all_intact(self, data: Bytes) -> Flags:
        """`intact` of n payloads. data: (n, length); returns (n,)."""
        return np.array([self.intact(bytearray(row)) for row in data], np.bool_)

    def counters(self, data: Bytes) -> npt.NDArray[np.int64]:
        """Counters of n payloads. data: (n, length); returns (n,)."""
        return data[:, 2].astype(np.int64)


@dataclass(frozen=True)
class Bits:
    """Bits of an unsigned integer signal. shift: of its lowest bit in the payload as one number."""

    shift: int
    mask: int
    big: bool

    def read(self, payload: bytes | bytearray) -> int:
        """Raw value."""
        word = int.from_bytes(payload, "big" if self.big else "little")
        return (word >> self.shift) & self.mask

    def write(self, payload: bytearray, raw: int) -> None:
        """Write a raw value into a payload, in place."""
        order: Literal["big", "little"] = "big" if self.big else "little"
        word = int.from_bytes(payload, order) & ~(self.mask << self.shift)
        payload[:] = (word | (raw & self.mask) << self.shift).to_bytes(len(payload), order)


@dataclass(frozen=True)
class Plain:
    """A counter signal, a checksum byte, or both, without a data id.

    bits   of the counter; None where there is none
    place  of the checksum, byte
    rule   of the checksum, over all other bytes; None where there is none
    """

    bits: Bits | None
    period: int
    place: int
    rule: Checksum | None

    def protect(self, payload: bytearray, counter: int) -> None:
        """Write counter and checksum into a payload, in place."""
        if self.bits is not None:
            self.bits.write(payload, counter)
        if self.rule is not None:
            payload[self.place] = checksum(self.rule, _without(payload, self.place))

    def intact(self, payload: bytearray) -> bool:
        """Whether the checksum is right, and the counter is below its period."""
        if self.bits is not None and self.bits.read(payload) >= self.period:
            return False
        if self.rule is None:
            return True
        return checksum(self.rule, _without(payload, self.place)) == payload[self.place]

    def counter(self, payload: bytes | bytearray) -> int | None:
        """Counter of a payload; None where there is none."""
        return None if self.bits is None else self.bits.read(payload)

    def all_intact(self, data: Bytes) -> Flags:
        """`intact` of n payloads. data: (n, length); returns (n,)."""
        if self.bits is None:
            good = np.ones(len(data), np.bool_)
        else:
            good = self.counters(data) < self.period
        if self.rule is not None:
            others = np.delete(data, self.place, axis=1)
            good &= checksums(self.rule, others) == data[:, self.place]
        return good

    def counters(self, data: Bytes) -> npt.NDArray[np.int64]:
        """Counters of n payloads. data: (n, length); returns (n,), 0 where there is no counter."""
        if self.bits is None:
            return np.zeros(len(data), np.int64)
        order = 1 if self.bits.big else -1
        bits = np.unpackbits(data[:, ::order], axis=1)  # highest bit of the number first
        last = bits.shape[1] - self.bits.shift
        columns = bits[:, last - self.bits.mask.bit_length() : last].astype(np.int64)
        return columns @ (1 << np.arange(columns.shape[1])[::-1])


def _without(payload: bytearray, place: int) -> bytearray:
    return payload[:place] + payload[place + 1 :]


HEADERS = {1: (2, 12), 2: (2, 12), 5: (3, 24)}  # profile: least bytes, bits of CRC and counter


def guard_of(message: Message, used: Sequence[str] = (), origin: str = "") -> Guard | None:
    """Protection of a message; None where it has none. used: signals that hold fields of the bench.

    Raises InputError where the message does not have the layout that its protection needs, or a field
    lies where the protection writes.
    """
    protection = message.protection
    if protection is None:
        return None
    if protection.profile == 0:
        written = {protection.counter}
        guard: Guard = _plain(message, protection)
        if protection.checksum is not None:
            written |= {protection.checksum.signal}
        taken = [name for name in used if name in written]
    elif protection.profile in HEADERS:
        length, bits = HEADERS[protection.profile]
        _require(message, length)
        guard = _profile(protection)
        taken = [name for name in used if min(_positions(message.signal(name))) < bits]
    else:
        raise InputError(
            f"message {message.name}: end-to-end protection is not laid out as a profile"
            " that is known here",
            expected="E2E profile 1, 2 or 5",
            found=f"profile {protection.profile}",
        )
    if taken:
        raise InputError(
            f"{message.name}.{taken[0]} is bound to a role, and the protection of the message writes there",
            where=origin,
            expected="a signal that holds neither checksum nor counter",
            remedy="bind another signal, or correct the protection of the message",
        )
    return guard


def _profile(protection: Protection) -> Guard:
    match protection.profile:
        case 1:
            return Profile1(protection.data_id)
        case 2:
            return Profile2(protection.data_ids)
    return Profile5(protection.data_id)


def _positions(signal: Signal) -> Iterator[int]:
    """Bits of a signal, as a DBC numbers them: 8 * byte + n, n = 0 the byte's lowest."""
    for bit in range(signal.first_bit, signal.first_bit + signal.length):
        yield bit if signal.little_endian else 8 * (bit // 8) + 7 - bit % 8


def _require(message: Message, length: int) -> None:
    if message.length < length:
        raise InputError(
            f"message {message.name} is too short for its end-to-end protection",
            expected=f"at least {length} bytes",
            found=f"{message.length} bytes",
        )


def _plain(message: Message, protection: Protection) -> Plain:
    bits, period, place = None, 0, 0
    if protection.counter:
        signal = message.signal(protection.counter)
        if signal.signed or signal.is_float or signal.multiplexer or signal.length > 16:
            raise _unfit(message, signal, "a counter", "an unsigned integer of 1 to 16 bits")
        bits = bits_of(signal, message.length)
        period = protection.period or 1 << signal.length
        if period > 1 << signal.length:
            raise InputError(
                f"signal {message.name}.{signal.name} cannot count {period} values",
                expected=f"a period of at most {1 << signal.length}",
                found=f"period = {period}, {signal.length} bits",
            )
    if protection.checksum is not None:
        signal = message.signal(protection.checksum.signal)
        if signal.length != 8 or signal.first_bit % 8 or signal.multiplexer or signal.is_float:
            raise _unfit(message, signal, "a checksum", "one whole byte")
        place = signal.first_bit // 8
    return Plain(bits, period, place, protection.checksum)


def _unfit(message: Message, signal: Signal, what: str, expected: str) -> InputError:
    return InputError(
        f"signal {message.name}.{signal.name} cannot be {what}",
        expected=f"{expected} that is in every frame",
        found=f"{signal.length} bits, start bit {signal.start}",
    )


def bits_of(signal: Signal, length: int) -> Bits:
    """Bits of an integer signal in a payload of `length` bytes."""
    mask = (1 << signal.length) - 1
    if signal.little_endian:
        return Bits(signal.start, mask, False)
    return Bits(8 * length - signal.first_bit - signal.length, mask, True)

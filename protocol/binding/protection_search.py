"""Counters and checksums of a capture, identified from the payloads of one message.

CRC, XOR and the AUTOSAR profiles are linear over GF(2): of payloads of one length, the CRC with any start
value, final XOR and data id differs from the CRC that starts at 0 by a constant. A rule therefore holds
when (checksum byte) XOR (CRC from 0 over the other bytes) is the same in all frames; no search over
start values is needed, and the constant gives the data id. Profile 2 has one constant for each
counter value.

Chance: a rule counts only where it explains at least `LEAST_FRAMES` different payloads beyond its free
constants. Random bytes satisfy one of about 3000 rules with a probability below 3000 / 256^11. A rule
that two different polynomials satisfy, or a byte that copies another one, is not proven by the capture.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from slipbench.protocol.codec.checksum import checksums, crc8_table
from slipbench.protocol.database.layout import Checksum, Protection

Bytes = npt.NDArray[np.uint8]

LEAST_FRAMES = 12  # different payloads that a rule must explain beyond its free constants
MOST_FRAMES = 400  # different payloads that are looked at first
SHARE = 0.98  # of the frames that a rule must explain; a capture may hold damaged frames
LEAST_VALUES = 8  # of a checksum; one that hardly changes is no evidence
COPY = 0.9  # share of frames from which a byte counts as the copy of another
STEADY = 0.9  # share of a counter's steps that are the same
LEAST_STEPS = 24  # steps of a counter that must be observed
COMMON = (0x1D, 0x2F, 0x07, 0x31, 0x9B, 0xD5, 0x39, 0x4D)  # polynomials that are in use


@dataclass(frozen=True)
class Byte:
    """A checksum in one byte of a message, over all other bytes.

    place    byte; the Checksum that is `rule` has no signal yet
    share    of all frames that the rule explains
    others   rules that explain the frames as well: the capture does not decide
    """

    place: int
    rule: Checksum
    share: float
    others: tuple[Checksum, ...] = ()


@dataclass(frozen=True)
class Profile:
    """An AUTOSAR profile that the frames obey. equivalent: number of data ids with the same CRC."""

    protection: Protection
    share: float
    equivalent: int = 1


class Counter(NamedTuple):
    """A counter: number of its values, and its step from frame to frame."""

    period: int
    step: int


def different(data: Bytes) -> Bytes:
    """Payloads without repetitions, at most MOST_FRAMES of them, in order. data: (n, length).

    They are drawn at random, from a fixed seed: every third frame, say, would show five of the fifteen
    values of a counter.
    """
    rows = np.sort(np.unique(data, axis=0, return_index=True)[1])
    if len(rows) > MOST_FRAMES:
        rows = np.sort(np.random.default_rng(0).choice(rows, MOST_FRAMES, replace=False))
    return data[rows]


def counter_of(raw: npt.NDArray[np.int64], width: int) -> Counter | None:
    """Counter that raw values are; None where they do not count. raw: (n,), width: bits.

    A counter counts up by the same step in nearly every frame: by 1, or by more where a logger drops
    frames regularly.
    """
    if raw.size <= LEAST_STEPS or width < 2:
        return None
    top, wraps = int(raw.max()) + 1, bool(np.any(np.diff(raw) < 0))
    periods = {1 << width, top} if wraps and top > 2 else {1 << width}
    found = {each: _steady(raw, each) for each in periods}
    period = max(found, key=lambda each: (found[each][0], each))
    share, step = found[period]
    return Counter(period, step) if share >= STEADY else None


def _steady(raw: npt.NDArray[np.int64], period: int) -> tuple[float, int]:
    """Share of the steps that are the usual one, and that one; 0 where this does not count up."""
    values, counts = np.unique(np.diff(raw) % period, return_counts=True)
    usual = int(values[counts.argmax()])
    if not 0 < usual <= period // 2 or np.unique(raw).size < min(period, LEAST_VALUES):
        return 0.0, 0
    return float(counts.max() / (raw.size - 1)), usual


def find_profile(data: Bytes) -> Profile | None:
    """AUTOSAR E2E profile 1, 2 or 5 of the payloads of one message. data: (n, length) bytes."""
    few = different(data)
    if few.shape[1] < 3 or len(few) < LEAST_FRAMES:
        return None
    for search in (_profile5, _profile2, _profile1):
        found = search(few, data)
        if found is not None:
            return found
    return None


def find_checksum(data: Bytes, places: tuple[int, ...]) -> Byte | None:
    """Checksum in one of the bytes `places` over all other bytes. data: (n, length) bytes."""
    few = different(data)
    if few.shape[1] < 2 or len(few) <= LEAST_FRAMES:
        return None
    found = [each for place in places for each in _byte(few, data, place)]
    return max(found, key=lambda each: (not each.others, each.share)) if found else None


def _profile1(few: Bytes, data: Bytes) -> Profile | None:
    counters = _nibble_counter(few, 15)
    if counters is None:
        return None
    constant = _constant(_crc(0x1D, few[:, 1:]) ^ few[:, 0])
    if constant is None or len(np.unique(few[:, 0])) < LEAST_VALUES:
        return None
    ids = _ids_with_start(constant, few.shape[1] - 1)
    share = float(np.mean(_crc(0x1D, data[:, 1:]) ^ data[:, 0] == constant))
    return Profile(Protection(1, int(ids[0])), share, len(ids))


def _profile2(few: Bytes, data: Bytes) -> Profile | None:
    counters = _nibble_counter(few, 16)
    if counters is None or len(few) - 16 < LEAST_FRAMES:
        return None
    ids = _profile2_ids(few)
    lists = [_constant(ids[counters == value]) for value in range(16)]
    if any(each is None for each in lists):
        return None
    known = np.array([each or 0 for each in lists], np.uint8)
    right = known[data[:, 1] & 0x0F] == _profile2_ids(data)
    return Profile(Protection(2, data_ids=bytes(known)), float(right.mean()))


def _profile2_ids(data: Bytes) -> Bytes:
    """Data id that the CRC of each frame implies: crc = table[state ^ id] ^ 0xFF."""
    table = np.array(crc8_table(0x2F), np.uint8)
    inverse = np.argsort(table).astype(np.uint8)
    state = np.full(len(data), 0xFF, np.uint8)
    for column in range(1, data.shape[1]):
        state = table[state ^ data[:, column]]
    return np.asarray(inverse[data[:, 0] ^ 0xFF] ^ state, np.uint8)


def _profile5(few: Bytes, data: Bytes) -> Profile | None:
    constant = _constant(_profile5_residual(few))
    if constant is None or len(np.unique(few[:, 2])) < LEAST_VALUES:
        return None
    ids = np.arange(1 << 16, dtype=np.uint16)
    zero = np.zeros(1 << 16, np.uint16)
    of_id = _crc16(zero, np.column_stack([ids & 0xFF, ids >> 8]).astype(np.uint8))
    data_id = int(np.flatnonzero(of_id == constant)[0])
    share = float(np.mean(_profile5_residual(data) == constant))
    return Profile(Protection(5, data_id), share)


def _profile5_residual(data: Bytes) -> npt.NDArray[np.uint16]:
    """CRC in the frame XOR the CRC with data id 0: what the data id contributes, (n,)."""
    sent = data[:, 0].astype(np.uint16) | data[:, 1].astype(np.uint16) << np.uint16(8)
    padded = np.column_stack([data[:, 2:], np.zeros((len(data), 2), np.uint8)])
    return np.asarray(sent ^ _crc16(np.full(len(data), 0xFFFF, np.uint16), padded), np.uint16)


def _byte(few: Bytes, data: Bytes, place: int) -> Iterator[Byte]:
    """Rules that explain one byte; one, with the others in it."""
    content, check = np.delete(few, place, axis=1), few[:, place]
    if len(np.unique(content, axis=0)) <= LEAST_FRAMES or not _depends(content, check):
        return
    rules = list(_rules(content, check))
    if not rules:
        return
    others, sent = np.delete(data, place, axis=1), data[:, place]
    shares = [float(np.mean(checksums(rule, others) == sent)) for rule in rules]
    yield Byte(place, rules[0], shares[0], tuple(rules[1:]))


def _rules(content: Bytes, check: Bytes) -> Iterator[Checksum]:
    """Rules that agree with all different payloads, the most usual first."""
    fold = np.bitwise_xor.reduce(content, axis=1)
    total = content.sum(axis=1, dtype=np.uint8)
    if (start := _constant(fold ^ check)) is not None:
        yield Checksum("", "xor", start=start)
    if (start := _constant(check - total)) is not None:
        yield Checksum("", "sum", start=start)
    elif (end := _constant(check + total)) is not None:
        yield Checksum("", "sum", start=(0xFF - end) & 0xFF, final_xor=0xFF)
    for polynomial in (*COMMON, *(p for p in range(3, 256, 2) if p not in COMMON)):
        constant = _constant(_crc(polynomial, content) ^ check)
        if constant is not None:
            yield _tidy(polynomial, constant, content.shape[1])


def _tidy(polynomial: int, constant: int, length: int) -> Checksum:
    """CRC rule with start and final XOR of 0 or 0xFF where these give the constant."""
    empty = np.zeros((1, length), np.uint8)
    for start, end in ((0, 0), (0xFF, 0xFF), (0xFF, 0), (0, 0xFF)):
        if int(_crc(polynomial, empty, start)[0]) ^ end == constant:
            return Checksum("", "crc8", polynomial, start, end)
    return Checksum("", "crc8", polynomial, 0, constant)


def _crc(polynomial: int, content: Bytes, start: int = 0) -> Bytes:
    table = np.array(crc8_table(polynomial), np.uint8)
    state = np.full(len(content), start, np.uint8)
    for column in range(content.shape[1]):
        state = table[state ^ content[:, column]]
    return state


def _crc16(state: npt.NDArray[np.uint16], content: Bytes) -> npt.NDArray[np.uint16]:
    """CRC-16/CCITT-FALSE, polynomial 0x1021, from `state`, (n,)."""
    crc = state.copy()
    for column in range(content.shape[1]):
        crc ^= content[:, column].astype(np.uint16) << np.uint16(8)
        for _ in range(8):
            crc = np.where(crc & 0x8000, (crc << 1) ^ 0x1021, crc << 1).astype(np.uint16)
    return crc


def _constant(residual: npt.NDArray[np.unsignedinteger]) -> int | None:
    """Value that nearly all residuals have, (n,); None where there is none or too few frames."""
    if residual.size == 0:
        return None
    values, counts = np.unique(residual, return_counts=True)
    if counts.max() < SHARE * residual.size:
        return None
    return int(values[counts.argmax()])


def _depends(content: Bytes, check: Bytes) -> bool:
    """Whether a checksum depends on more than one byte: it changes, and it copies none of them."""
    if len(np.unique(check)) < LEAST_VALUES:
        return False
    varying = [column for column in content.T if len(np.unique(column)) > 1]
    return len(varying) > 1 and not any(_copies(column, check) for column in varying)


def _copies(column: Bytes, check: Bytes) -> bool:
    """Whether a byte alone explains most of the others, but for a constant."""
    return any(
        np.unique(residual, return_counts=True)[1].max() > COPY * residual.size
        for residual in (column ^ check, check - column, check + column)
    )


def _nibble_counter(few: Bytes, period: int) -> npt.NDArray[np.uint8] | None:
    """Low nibble of byte 1 where it takes all values of a counter of this period; else None."""
    values = few[:, 1] & 0x0F
    distinct = np.unique(values)
    if len(distinct) < period or (period == 15 and distinct[-1] == 15):
        return None
    return np.asarray(values, np.uint8)


def _ids_with_start(constant: int, length: int) -> npt.NDArray[np.int64]:
    """Data ids of profile 1 whose CRC, carried through `length` zero bytes, is the constant."""
    table = np.array(crc8_table(0x1D), np.uint8)
    ids = np.arange(1 << 16)
    state = table[table[ids & 0xFF] ^ (ids >> 8).astype(np.uint8)]
    for _ in range(length):
        state = table[state]
    return np.flatnonzero(state == constant)

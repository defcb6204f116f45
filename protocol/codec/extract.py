"""The bits of one signal, cut out of many payloads at once."""

import sys
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.protocol.database.layout import Signal

Words = npt.NDArray[np.uint64]
Raw = npt.NDArray[np.int64] | npt.NDArray[np.uint64] | npt.NDArray[np.float64]

EXACT_BITS = 53  # integers beyond 2^53 do not all have a double
_FLOATS = {16: (np.uint16, np.float16), 32: (np.uint32, np.float32), 64: (np.uint64, np.float64)}


def words(data: npt.NDArray[np.uint8]) -> Words:
    """See payloads (n, 8 m) as (n, m) words of 8 bytes, byte 0 lowest; without copying."""
    return np.ascontiguousarray(data).view("<u8")


def raw(signal: Signal, payloads: Words) -> Raw:
    """Raw values of a signal, (n,): int64, uint64 where unsigned and 64 bits wide, or float64."""
    top = _to_the_top(signal, payloads)
    unused = np.uint64(64 - signal.length)
    if signal.is_float:
        bits, number = _FLOATS[signal.length]
        with np.errstate(invalid="ignore"):
            return (top >> unused).astype(bits).view(number).astype(np.float64)
    if signal.signed:
        return top.view(np.int64) >> np.int64(unused)
    value = top >> unused
    return value if signal.length == 64 else value.view(np.int64)


def _to_the_top(signal: Signal, payloads: Words) -> Words:
    """Shift a signal to the upper end of a word, so that one more shift removes the other bits."""
    word, bit = divmod(signal.first_bit, 64)
    if signal.little_endian:
        excess = bit + signal.length - 64  # bits that lie in the next word
        if excess <= 0:
            return payloads[:, word] << np.uint64(-excess)
        low = payloads[:, word] >> np.uint64(bit)
        joined = low | payloads[:, word + 1] << np.uint64(64 - bit)
        return joined << np.uint64(64 - signal.length)
    top = _sent_first(payloads, word) << np.uint64(bit)
    if bit + signal.length > 64:
        top |= _sent_first(payloads, word + 1) >> np.uint64(64 - bit)
    return top


def _sent_first(payloads: Words, word: int) -> Words:
    """One word with its bytes reversed, so that byte 0 becomes the highest."""
    column = payloads[:, word]
    return column.byteswap() if sys.byteorder == "little" else column


def physical(signal: Signal, values: Raw) -> npt.NDArray[Any]:
    """Physical values, shape (n,), in the database's unit: raw * scale + offset, rounded as by cantools.

    Whole scale and offset on whole numbers give whole numbers: int64, or uint64 where only that
    holds them. All else is float64, and where doubles cannot hold the raw value exactly the sum is
    formed with Python's integers first.
    """
    scale, offset = signal.scale, signal.offset
    if signal.is_float:
        with np.errstate(all="ignore"):  # a NaN or an infinity that was sent is no trouble here
            return values if (scale, offset) == (1, 0) else values * float(scale) + float(offset)
    if float(scale).is_integer() and float(offset).is_integer():
        return _whole(signal, values, int(scale), int(offset))
    if isinstance(scale, int) and signal.length + scale.bit_length() > EXACT_BITS:
        return np.array([value * scale + offset for value in values.tolist()], np.float64)
    product = values * np.float64(scale)
    return product if offset == 0 and scale > 0 else np.add(product, float(offset), out=product)


def _whole(signal: Signal, values: Raw, scale: int, offset: int) -> npt.NDArray[Any]:
    if (scale, offset) == (1, 0):
        return values
    ends = [limit * scale + offset for limit in signal.raw_range]
    if min(*ends, *signal.raw_range) >= -(1 << 63) and max(*ends, *signal.raw_range) < 1 << 63:
        return values * np.int64(scale) + np.int64(offset)
    exact = [value * scale + offset for value in values.tolist()]
    wide = min(ends) >= 0 and max(ends) < 1 << 64
    return np.array(exact, np.uint64 if wide else np.float64)

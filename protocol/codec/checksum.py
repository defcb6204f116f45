"""One-byte checksums of payloads: XOR, sum, or CRC-8 of a stated polynomial."""

from functools import cache

import numpy as np
import numpy.typing as npt

from slipbench.protocol.database.layout import Checksum

Bytes = npt.NDArray[np.uint8]


def checksums(rule: Checksum, data: Bytes) -> Bytes:
    """Checksums of n byte strings. data: (n, m); returns (n,).

    The CRC is not reflected: the highest bit first (Williams, "A painless guide to CRC error
    detection algorithms", 1993).
    """
    if rule.kind == "xor":
        state = np.bitwise_xor.reduce(data, axis=1) ^ rule.start
    elif rule.kind == "sum":
        state = data.sum(axis=1) + rule.start
    else:
        table = np.array(crc8_table(rule.polynomial))
        state = np.full(len(data), rule.start)
        for column in range(data.shape[1]):
            state = table[state ^ data[:, column]]
    return np.asarray(state ^ rule.final_xor).astype(np.uint8)


def checksum(rule: Checksum, data: bytes | bytearray) -> int:
    """Checksum of one byte string."""
    state = rule.start
    if rule.kind == "xor":
        for byte in data:
            state ^= byte
    elif rule.kind == "sum":
        state = (state + sum(data)) & 0xFF
    else:
        table = crc8_table(rule.polynomial)
        for byte in data:
            state = table[state ^ byte]
    return state ^ rule.final_xor


@cache
def crc8_table(polynomial: int) -> tuple[int, ...]:
    """CRC-8 of each byte. polynomial: without its highest term, as in 0x1D for SAE J1850."""
    table = list(range(256))
    for _ in range(8):
        table = [((crc << 1) ^ (polynomial if crc & 0x80 else 0)) & 0xFF for crc in table]
    return tuple(table)

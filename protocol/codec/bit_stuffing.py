"""The bits of one CAN frame, its stuff bits counted exactly; the tables that do it for many.

After five equal bits a sender inserts their complement (ISO 11898-1, bit stuffing). A classic frame
stuffs from start of frame to the end of its CRC-15; a CAN FD frame stuffs so up to the end of its
data and then puts a fixed stuff bit before its stuff count and after every fourth bit from there.
Counted with the three bits of interframe space. For one frame at a time plain integers beat arrays;
`protocol/codec/frame_bits.py` counts whole logs.
"""

from functools import cache, lru_cache

CLASSIC_TAIL = 1 + 1 + 1 + 7 + 3  # CRC delimiter, ACK, its delimiter, end of frame, space
FD_TAIL = CLASSIC_TAIL  # all at the nominal rate again
DLC = {**{n: n for n in range(9)}, 12: 9, 16: 10, 20: 11, 24: 12, 32: 13, 48: 14, 64: 15}
CRC15 = 0x4599
START = 0b100  # state of the stuffing before a frame: the bus was recessive for long

Pieces = list[tuple[int, int]]  # bits, and how many of them


def classic_bits(
    identifier: int, extended: bool, data: bytes | bytearray, requested: int | None = None
) -> int:
    """Exact bits of one classic frame; `requested` given: a remote frame that asks for so many."""
    length = len(data) if requested is None else requested
    size, crc, state, stuffed = _classic_header(identifier, extended, length, requested is not None)
    crc_table, steps = crc15_table(), _steps_by_width()
    eight = steps[8]
    for byte in data:
        crc = (crc << 8 & 0x7FFF) ^ crc_table[crc >> 7 ^ byte]
        step = eight[state << 8 | byte]
        stuffed += step >> 3
        state = step & 7
    step = steps[7][state << 7 | crc >> 8]
    last = eight[(step & 7) << 8 | crc & 0xFF]
    return stuffed + (step >> 3) + (last >> 3) + size + 8 * len(data) + 15 + CLASSIC_TAIL


@lru_cache(maxsize=4096)
def _classic_header(
    identifier: int, extended: bool, length: int, remote: bool
) -> tuple[int, int, int, int]:
    """Bits up to the data, and CRC, state of the stuffing and stuff bits at their end."""
    control = remote << 6 | min(length, 8)  # RTR, IDE or r1, r0, DLC
    size = 39 if extended else 19
    pieces = _bytes_of(arbitration(identifier, extended) << 7 | control, size)
    crc, crc_table = 0, crc15_table()
    for piece, _ in pieces:
        crc = (crc << 8 & 0x7FFF) ^ crc_table[crc >> 7 ^ piece]
    stuffed, state = _stuff(pieces, START)
    return size, crc, state, stuffed


def fd_bits(
    identifier: int,
    extended: bool,
    data: bytes | bytearray,
    switches_rate: bool = True,
    error_passive: bool = False,
) -> tuple[int, int]:
    """Exact bits of one CAN FD frame: at the nominal rate, and at the data rate if it switches.

    `error_passive` is the sender's state, which its ESI bit gives.
    """
    length = len(data)
    # RRS (and IDE) 0, FDF 1, res 0, BRS; then at the data rate ESI and DLC
    slow = arbitration(identifier, extended) << (4 if extended else 5) | 0b100 | switches_rate
    slow_size = 36 if extended else 17
    first, state = _stuff(_bytes_of(slow, slow_size), START)
    control = error_passive << 4 | DLC[length]
    second, state = _stuff([(control, 5), *((byte, 8) for byte in data)], state)
    last_bit = (data[-1] if length else control) & 1
    second -= (state >> 2) != last_bit  # there the fixed stuff bit takes the place of this one
    crc, fixed = (17, 6) if length <= 16 else (21, 7)
    before, after = first + slow_size + FD_TAIL, second + 5 + 8 * length + 4 + crc + fixed
    return (before, after) if switches_rate else (before + after, 0)


def arbitration(identifier: int, extended: bool) -> int:
    """Start of frame (0) and identifier; an extended one with SRR and IDE between its parts."""
    if not extended:
        return identifier
    return (identifier >> 18) << 20 | 0b11 << 18 | identifier & 0x3FFFF


def _bytes_of(value: int, size: int) -> Pieces:
    """Cut `size` bits into bytes from the end; the remaining bits come first."""
    head = size % 8
    pieces = [(value >> (size - head), head)] if head else []
    pieces += [(value >> shift & 0xFF, 8) for shift in range(size - head - 8, -1, -8)]
    return pieces


def _stuff(pieces: Pieces, state: int) -> tuple[int, int]:
    """Count stuff bits; returns them and the state at the end (see `stuffing_steps`)."""
    count, steps = 0, _steps_by_width()
    for piece, width in pieces:
        step = steps[width][state << width | piece]
        count, state = count + (step >> 3), step & 7
    return count, state


@cache
def crc15_table() -> list[int]:
    """CRC-15 of every byte; the zeros before a short first piece do not change it."""
    table = [number << 7 for number in range(256)]
    for _ in range(8):
        table = [(crc << 1 & 0x7FFF) ^ (CRC15 if crc & 0x4000 else 0) for crc in table]
    return table


@cache
def _steps_by_width() -> list[list[int]]:
    return [[], *(stuffing_steps(width) for width in range(1, 9))]


@cache
def stuffing_steps(width: int) -> list[int]:
    """Stuffing as a machine of 8 states: last bit sent * 4 + equal bits so far - 1.

    Entry [state << width | bits]: stuff bits inserted * 8 + next state.
    """
    return [_step(state, bits, width) for state in range(8) for bits in range(1 << width)]


def _step(state: int, bits: int, width: int) -> int:
    last, run, stuffed = state >> 2, (state & 3) + 1, 0
    for place in reversed(range(width)):
        bit = bits >> place & 1
        last, run = bit, run + 1 if bit == last else 1
        if run == 5:
            last, run, stuffed = 1 - bit, 1, stuffed + 1
    return stuffed * 8 + last * 4 + run - 1

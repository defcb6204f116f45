"""Whether every message reaches the bus in time, in the worst case, from the database alone.

Worst-case response times after Davis, Burns, Bril and Lukkien, "Controller Area Network (CAN)
schedulability analysis: refuted, revisited and improved", Real-Time Systems 35 (2007) 239-272:
a frame waits for the longest frame of lower priority that has just begun, then for every frame of
higher priority, over all its instances in the busy period. Frame lengths are the paper's equation
(1): g = 34 (11-bit) or 54 (29-bit) stuffable control bits, 8 s data bits, 13 unstuffed bits, and
floor((g + 8 s - 1) / 4) stuff bits.

Event messages count at their least spacing, which the database gives as their cycle time; queuing
jitter is a parameter, the same for all.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

from slipbench.protocol.codec.bit_stuffing import CLASSIC_TAIL, FD_TAIL
from slipbench.protocol.database.layout import Database, Message
from slipbench.protocol.errors import InputError

NEVER = float("inf")


@dataclass(frozen=True)
class Scheduled:
    """One message on its bus: longest transmission, period and worst-case response time, s."""

    message: Message
    transmission: float
    period: float
    response: float

    @property
    def load(self) -> float:
        """Share of the bus, 0..1."""
        return self.transmission / self.period


def schedule(
    database: Database, bitrate: float, data_bitrate: float | None = None, jitter: float = 0.0
) -> tuple[Scheduled, ...]:
    """Schedule of all messages, most urgent first. bitrate: bit/s; jitter: s.

    A response time is infinite where the bus is overloaded by what is at least as urgent. Raises
    InputError where a message states no cycle time.
    """
    ordered = sorted(database.messages, key=_priority)
    costs = [longest(message, bitrate, data_bitrate) for message in ordered]
    periods = [_period(message, database) for message in ordered]
    bit = 1 / bitrate
    return tuple(
        Scheduled(message, costs[rank], periods[rank], _response(rank, costs, periods, jitter, bit))
        for rank, message in enumerate(ordered)
    )


def load(scheduled: Sequence[Scheduled]) -> float:
    """Worst-case load of the bus, 0..1."""
    return sum(each.load for each in scheduled)


def longest(message: Message, bitrate: float, data_bitrate: float | None = None) -> float:
    """Longest time on the bus of one frame, every possible stuff bit included, s."""
    data = 8 * message.length
    if not message.fd:
        stuffable = (54 if message.extended else 34) + data
        return (stuffable + (stuffable - 1) // 4 + CLASSIC_TAIL) / bitrate
    slow = 36 if message.extended else 17
    stuffed = (slow - 1) // 4  # at the nominal rate; the others fall into the data phase
    fast = 5 + data
    crc = 17 + 4 + 6 if message.length <= 16 else 21 + 4 + 7
    more = (slow + fast - 1) // 4 - stuffed
    return (slow + stuffed + FD_TAIL) / bitrate + (fast + more + crc) / (data_bitrate or bitrate)


def _priority(message: Message) -> tuple[int, int, int]:
    """Order of arbitration: the first 11 bits, then 11-bit before 29-bit, then the rest."""
    if message.extended:
        return message.identifier >> 18, 1, message.identifier & 0x3FFFF
    return message.identifier, 0, 0


def _period(message: Message, database: Database) -> float:
    if message.cycle_time is None:
        raise InputError(
            f"message {message.name} states no cycle time",
            where=database.origin,
            remedy="give it a GenMsgCycleTime, the least spacing where it is sent on events",
        )
    return message.cycle_time


def _response(
    rank: int, costs: Sequence[float], periods: Sequence[float], jitter: float, bit: float
) -> float:
    """R_m of the paper: the longest of the responses of all instances in the busy period."""
    upto = list(zip(costs[: rank + 1], periods[: rank + 1], strict=True))
    if sum(cost / period for cost, period in upto) >= 1:
        return NEVER
    blocking = max(costs[rank + 1 :], default=0.0)
    busy = _fixed_point(blocking, upto, jitter, costs[rank])
    instances = ceil((busy + jitter) / periods[rank] - 1e-9)
    return max(
        jitter + _queued(q, rank, upto, blocking, jitter, bit) - q * periods[rank] + costs[rank]
        for q in range(instances)
    )


def _queued(
    q: int,
    rank: int,
    upto: Sequence[tuple[float, float]],
    blocking: float,
    jitter: float,
    bit: float,
) -> float:
    """w_m(q): how long instance q waits before its transmission starts."""
    own = upto[rank][0]
    return _fixed_point(blocking + q * own, upto[:rank], jitter + bit, blocking + q * own)


def _fixed_point(
    fixed: float, others: Sequence[tuple[float, float]], window: float, start: float
) -> float:
    """Least t with t = fixed + the frames of `others` that come within t + window."""
    t, before = start, -1.0
    while t != before:
        before = t
        t = fixed + sum(ceil((t + window) / period - 1e-9) * cost for cost, period in others)
    return t

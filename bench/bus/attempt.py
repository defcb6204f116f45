"""Attempt to send a frame: how long it occupies the wire, and how it ends.

An error occurs at some bit; then an error frame follows, and the frame is sent again.
"""

from collections.abc import Sequence
from typing import NamedTuple

from slipbench.bench.bus.counters import Confinement
from slipbench.bench.bus.events import Cause
from slipbench.bench.bus.frame import END_OF_FRAME, INTERMISSION, BitRates, Frame
from slipbench.bench.bus.node import Node

FLAG = 12 + 8  # bits of an error frame: superposed flags, delimiter
SUSPENDED = 8  # bits that an error-passive node waits after a frame of its own


class Attempt(NamedTuple):
    """A frame on the wire. begin, ends, free: ns; ends: last bit, free: end of the intermission.

    failed  senders that detect the error; the other senders succeed
    """

    begin: int
    ends: int
    free: int
    senders: tuple[Node, ...]
    frame: Frame
    error: Cause | None = None
    failed: tuple[Node, ...] = ()


def successful(rates: BitRates, begin: int, frame: Frame, senders: tuple[Node, ...]) -> Attempt:
    """Attempt without an error. begin: ns."""
    free = begin + round(rates.duration(frame))
    return Attempt(begin, free - round(INTERMISSION * rates.bit), free, senders, frame)


def destroyed(
    rates: BitRates, begin: int, frame: Frame, senders: tuple[Node, ...], part: float
) -> Attempt:
    """Attempt in which a bit is destroyed after `part` (0..1) of its length. begin: ns."""
    after = rates.bit + part * (rates.duration(frame) - (INTERMISSION + 1) * rates.bit)
    return _failing(rates, begin, after, frame, senders, Cause.BIT)


def unacknowledged(
    rates: BitRates, begin: int, until: int, frame: Frame, sender: Node
) -> tuple[Attempt, int]:
    """Attempt that no node acknowledges, and bus time (ns) of the skipped attempts before it.

    It is repeated without success. The counters of an error-passive node no longer change, so that
    of all attempts that end before `until` (ns) only the last is returned.
    """
    after = rates.duration(frame) - (INTERMISSION + END_OF_FRAME + 1) * rates.bit
    once = _failing(rates, begin, after, frame, (sender,), Cause.UNACKNOWLEDGED)
    if sender.state is not Confinement.PASSIVE:
        return once, 0
    lasts = once.free - begin
    cycle = lasts + round(SUSPENDED * rates.bit)
    skipped = max(0, (until - begin) // cycle - 1)
    begin += skipped * cycle
    last = _failing(rates, begin, after, frame, (sender,), Cause.UNACKNOWLEDGED)
    return last, skipped * lasts


def collision(rates: BitRates, begin: int, winners: Sequence[tuple[Frame, Node]]) -> Attempt:
    """Attempt of several frames with one identifier; the first different bit decides. begin: ns.

    Equal frames merge. An error-active node that loses also destroys the other frame; an
    error-passive node cannot.
    """
    dominant = min((frame for frame, _ in winners), key=lambda frame: frame.after_arbitration)
    through = tuple(node for frame, node in winners if frame == dominant)
    losers = tuple(node for frame, node in winners if frame != dominant)
    if not losers:
        return successful(rates, begin, dominant, through)
    if all(node.state is Confinement.PASSIVE for node in losers):
        wins = successful(rates, begin, dominant, through + losers)
        return wins._replace(error=Cause.COLLISION, failed=losers)
    other = next(frame for frame, _ in winners if frame != dominant)
    after = _common_bits(dominant, other) * rates.bit
    return _failing(rates, begin, after, dominant, through + losers, Cause.COLLISION)


def _failing(
    rates: BitRates, begin: int, after: float, frame: Frame, senders: tuple[Node, ...], cause: Cause
) -> Attempt:
    """Attempt that ends with an error frame, which begins `after` ns after its begin."""
    ends = begin + round(after + FLAG * rates.bit)
    free = ends + round(INTERMISSION * rates.bit)
    return Attempt(begin, ends, free, senders, frame, cause, senders)


def _common_bits(one: Frame, other: Frame) -> int:
    """Number of equal leading bits of two frames with one identifier, without stuff bits."""
    head = 39 if one.extended else 19
    if one.fd != other.fd or one.after_arbitration[1] != other.after_arbitration[1]:
        return head
    differing = int.from_bytes(one.data, "big") ^ int.from_bytes(other.data, "big")
    return head + 8 * len(one.data) - differing.bit_length() + 1

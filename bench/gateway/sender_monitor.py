"""Detect two senders of one message: two vehicles, or two benches, on one bus.

By the counters, within milliseconds: each of two senders has its own counter, so a frame repeats the
counter of the one before it, or goes on from the one before that. By the number of frames, within
half a second, where there is no counter.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from slipbench.protocol.codec import e2e
from slipbench.protocol.database.layout import Message

WINDOW = 0.5  # s over which frames are counted
TOO_MANY = 1.5  # times as many frames as the cycle time allows; one sender's jitter stays far below
# Frames out of turn, of which half as many as are due may go by: a controller that repeats a frame
# after an error in its last bit is no second sender, nor is a frame that overtook another.
OUT_OF_TURN, FORGIVEN = 4.0, TOO_MANY - 1.0


@dataclass
class _Turns:
    """The last two counters of one message, and how many frames came out of turn; time: s."""

    last: int | None = None
    before: int | None = None
    score: float = 0.0
    time: float = 0.0

    def count(self, counter: int, now: float, cycle: float, period: int) -> bool:
        """Evaluate a counter of `period` values; True where too many frames were out of turn.

        Lost frames leave a gap, which is no sign of a second sender.
        """
        self.score = max(0.0, self.score - FORGIVEN * max(0.0, now - self.time) / cycle)
        in_turn = counter == _next(self.last, period)
        if counter == self.last or (not in_turn and counter == _next(self.before, period)):
            self.score += 1.0
        self.before, self.last, self.time = self.last, counter, now
        return self.score >= OUT_OF_TURN


class SenderMonitor:
    """Counters and frame rates of every periodic message."""

    _counts: dict[str, int]
    _turns: dict[str, _Turns]

    def __init__(
        self,
        cycles: Mapping[str, float],
        ours: Collection[str] = (),
        periods: Mapping[str, int] | None = None,
    ) -> None:
        """Watch messages of the database, by name.

        cycles   cycle time of each periodic message, s
        ours     messages that only the bench sends
        periods  number of values of the counter, where it is not that of E2E profile 1
        """
        self._cycles, self._ours, self._periods = dict(cycles), frozenset(ours), periods or {}
        self._limit = {name: TOO_MANY * WINDOW / cycle + 2 for name, cycle in cycles.items()}
        self._window_ends = 0.0
        self._counts: dict[str, int]
        self._turns: dict[str, _Turns]
        self.trouble = ""
        self.forget()

    def heard(self, name: str, now: float, counter: int | None = None) -> None:
        """Evaluate a frame of message `name` from another sender, at `now` (s)."""
        if name in self._ours:
            self.trouble = f"another bench sends {name} on this bus"
        if name not in self._counts:
            return
        if now >= self._window_ends:
            self._window_ends = now + WINDOW
            self._counts = dict.fromkeys(self._counts, 0)
        self._counts[name] += 1
        if self._counts[name] > self._limit[name]:
            self.trouble = f"{name} comes more often than one sender sends it: two vehicles?"
        period = self._periods.get(name, e2e.PERIOD)
        if counter is not None and self._turns[name].count(
            counter, now, self._cycles[name], period
        ):
            self.trouble = f"{name} is counted by more than one sender: two vehicles?"

    def forget(self) -> None:
        """Restart the counts: the frames received came late, and many at once."""
        self._counts = dict.fromkeys(self._cycles, 0)
        self._turns = {name: _Turns() for name in self._cycles}


def _next(counter: int | None, period: int) -> int | None:
    return None if counter is None else (counter + 1) % period


def cycles_of(messages: Iterable[Message]) -> dict[str, float]:
    """Cycle time in s of each periodic message, by name."""
    return {
        message.name: message.cycle_time
        for message in messages
        if message.cycle_time and not message.attributes.get("GenMsgSendType")
    }

"""One message has one sender: two vehicles, or two benches, on one bus are found out."""

from collections.abc import Mapping

OURS = frozenset({"ActuatorCommand", "TrialStatus"})
WINDOW = 0.5  # s over which frames are counted
TOO_MANY = 1.5  # times as many frames as the cycle time allows; one sender's jitter stays far below


class Senders:
    """Counts the frames of every periodic message."""

    def __init__(self, cycles: Mapping[str, float]) -> None:
        """Know the cycle time (s) of each periodic message."""
        self._most = {name: TOO_MANY * WINDOW / cycle + 2 for name, cycle in cycles.items()}
        self._counts = dict.fromkeys(cycles, 0)
        self._window_ends = 0.0
        self.trouble = ""

    def heard(self, name: str, now: float) -> None:
        """Take note of a frame of message `name` that somebody else sent."""
        if name in OURS:
            self.trouble = f"another bench sends {name} on this bus"
        if name not in self._counts:
            return
        if now >= self._window_ends:
            self._window_ends = now + WINDOW
            self._counts = dict.fromkeys(self._counts, 0)
        self._counts[name] += 1
        if self._counts[name] > self._most[name]:
            self.trouble = f"{name} comes more often than one sender sends it: two vehicles?"

    def forget(self) -> None:
        """Count afresh: what has been heard came late, and much of it at once."""
        self._counts = dict.fromkeys(self._counts, 0)

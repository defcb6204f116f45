"""Recognise our own frames on a shared bus by comparison with what was sent.

On some interfaces python-can marks as sent all frames of the same machine, on others those of the
same socket (docs/decisions/own-frames-on-socketcan.md), so every frame that was sent is remembered
until its echo arrives.
"""

from collections import deque

Key = tuple[int, bool]  # identifier, and whether it is a 29-bit one
PATIENCE = 50  # frames sent without an echo: this interface does not echo
WAITING = 2000  # frames; a bus that stalls for two seconds still returns the sent frames


class TxEcho:
    """Frames that were sent and not echoed yet, oldest first, each identifier by itself.

    A controller sends the most urgent frame first: frames of different identifiers may overtake.
    """

    def __init__(self) -> None:
        """No frame is waiting for its echo."""
        self._waiting: dict[Key, deque[bytes]] = {}
        self._without_echo = 0
        self._any_echo = False

    @property
    def silent(self) -> bool:
        """Whether the interface does not echo our frames."""
        return not self._any_echo and self._without_echo >= PATIENCE

    def sent(self, key: Key, data: bytes) -> None:
        """Remember a frame that was handed to the bus."""
        self._waiting.setdefault(key, deque(maxlen=WAITING)).append(data)
        self._without_echo += 1

    def heard(self, key: Key, data: bytes) -> bool:
        """Whether this is one of our frames; earlier ones of its identifier were lost."""
        waiting = self._waiting.get(key)
        if waiting is None or data not in waiting:
            return False
        while waiting.popleft() != data:
            pass
        self._any_echo = True
        return True

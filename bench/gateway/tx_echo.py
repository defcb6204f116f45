"""Recognise our own frames on a shared bus by comparison with what was sent.

On some interfaces python-can marks as sent all frames of the same machine, on others those of the
same socket (docs/decisions/own-frames-on-socketcan.md), so every frame that was sent is remembered
until it is heard.
"""

from collections import deque

PATIENCE = 50  # frames sent without hearing one back: this interface does not echo
WAITING = 2000  # frames; a bus that stalls for two seconds still gives back what was sent


class TxEcho:
    """Frames that were sent and not heard yet, oldest first, each identifier by itself.

    A controller sends what is urgent first: frames of different identifiers may overtake.
    """

    def __init__(self) -> None:
        """Have sent nothing."""
        self._waiting: dict[int, deque[bytes]] = {}
        self._unheard = 0
        self._heard_any = False

    @property
    def silent(self) -> bool:
        """Tell whether the interface does not let us hear ourselves."""
        return not self._heard_any and self._unheard >= PATIENCE

    def sent(self, identifier: int, data: bytes) -> None:
        """Remember a frame that was handed to the bus."""
        self._waiting.setdefault(identifier, deque(maxlen=WAITING)).append(data)
        self._unheard += 1

    def heard(self, identifier: int, data: bytes) -> bool:
        """Tell whether this is one of ours; those of its identifier before it were lost."""
        waiting = self._waiting.get(identifier)
        if waiting is None or data not in waiting:
            return False
        while waiting.popleft() != data:
            pass
        self._heard_any = True
        return True

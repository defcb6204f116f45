"""Which frames are our own: on a shared bus only a comparison with what was sent can tell.

On some interfaces python-can marks as sent all frames of the same machine, on others those of the
same socket (docs/decisions/own-frames-on-socketcan.md), so every frame that was sent is remembered
until it is heard.
"""

from collections import deque

Frame = tuple[int, bytes]
PATIENCE = 50  # frames sent without hearing one back: this interface does not echo
WAITING = 2000  # frames; a bus that stalls for two seconds still gives back what was sent


class OwnFrames:
    """Frames that were sent and not heard yet, oldest first."""

    def __init__(self) -> None:
        """Have sent nothing."""
        self._waiting: deque[Frame] = deque(maxlen=WAITING)
        self._heard_any = False

    @property
    def silent(self) -> bool:
        """Tell whether the interface does not let us hear ourselves."""
        return not self._heard_any and len(self._waiting) >= PATIENCE

    def sent(self, identifier: int, data: bytes) -> None:
        """Remember a frame that was handed to the bus."""
        self._waiting.append((identifier, data))

    def heard(self, identifier: int, data: bytes) -> bool:
        """Tell whether this is one of ours; those sent before it were lost, and are forgotten."""
        frame = (identifier, data)
        if frame not in self._waiting:
            return False
        while self._waiting.popleft() != frame:
            pass
        self._heard_any = True
        return True

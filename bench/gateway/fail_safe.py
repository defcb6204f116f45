"""What the gateway still does after an exception: release authority, report, record.

The frames that release authority are encoded before the first tick, one for each value of the
end-to-end counter, so that no code that may have failed is needed to send one.
"""

import traceback
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from slipbench.protocol.codec import e2e
from slipbench.protocol.codec.codec import Codec, Sender
from slipbench.protocol.codec.messages import ActuatorCommand, Authority, TrialStatus

Frame = tuple[int, bytes]
RELEASE = "ActuatorCommand"
RELEASED = ActuatorCommand(Authority.NONE, 0.0, 0.0, 0.0)
DEEPEST = 3  # places in the program that a note names


class FailSafe:
    """Frames that are ready, and steps of which each may fail without stopping the next."""

    def __init__(self, codec: Codec) -> None:
        """Encode the frames that release authority."""
        self.active = False
        self.records_sent = False  # the interface does not echo what the bench sends
        self._ready = [codec.encode(RELEASED, counter=n) for n in range(e2e.PERIOD)]

    def release(self, sender: Sender, now: float) -> Frame:
        """Return the frame that releases authority, under the next counter; now: s."""
        counter = sender.counters.get(RELEASE, 0)
        made = self.attempt(sender.encode, replace(RELEASED, time=now))
        sender.counters[RELEASE] = (counter + 1) % e2e.PERIOD
        frame: Frame = made or self._ready[counter]
        return frame

    def status(self, sender: Sender, status: TrialStatus) -> Frame | None:
        """Return the frame of `status`; None where it cannot be encoded."""
        frame: Frame | None = self.attempt(sender.encode, status)
        return frame

    @staticmethod
    def attempt(step: Callable[..., Any], *arguments: object, default: Any = None) -> Any:
        """Return what `step` returns, or `default` where it raises: the next step still runs."""
        try:
            return step(*arguments)
        except Exception:
            return default


def described(fault: BaseException) -> str:
    """Return an exception in one line: kind, words, and where in the program."""
    places = traceback.extract_tb(fault.__traceback__)[-DEEPEST:]
    where = " < ".join(f"{place.name}:{place.lineno}" for place in reversed(places))
    return f"{type(fault).__name__}: {fault} ({where})"

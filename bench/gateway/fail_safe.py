"""What the gateway still does after an exception: release authority, report, record.

The frames that release authority are encoded before the first tick, one for each value of the
end-to-end counter, so that no code that may have failed is needed to send one.
"""

import traceback
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from slipbench.protocol.codec.codec import Codec, Frame, Sender
from slipbench.protocol.codec.messages import ActuatorCommand, Authority, TrialStatus

RELEASE = "ActuatorCommand"
RELEASED = ActuatorCommand(Authority.NONE, 0.0, 0.0, 0.0)
DEEPEST = 3  # places in the program that a note names


class FailSafe:
    """Frames that are ready, and steps of which each may fail without stopping the next."""

    def __init__(self, codec: Codec, *, silent: bool = False) -> None:
        """Encode the frames that release authority. silent: an end of requests releases it."""
        self.active = False
        self._ready: dict[str, list[Frame]] = {}
        if silent or not codec.has(RELEASE):
            return
        for carrier in codec.carriers(RELEASE):
            plan = codec.plan_of(carrier)
            words = [part.pack(RELEASED) for part in plan.parts if part.name == RELEASE]
            counters = range(plan.counter_period)
            self._ready[carrier] = [codec.finish(plan, words, counter) for counter in counters]

    def release(self, sender: Sender, now: float) -> list[Frame]:
        """Frames that release authority, under the next counters; now: s."""
        if not self._ready:
            return []
        counters = {name: sender.counters.get(name, 0) for name in self._ready}
        command = replace(RELEASED, time=now)
        made: list[Frame] | None = self.attempt(sender.frames, command)
        for name, frames in self._ready.items():
            sender.counters[name] = (counters[name] + 1) % len(frames)
        return made or [frames[counters[name]] for name, frames in self._ready.items()]

    def status(self, sender: Sender, status: TrialStatus) -> list[Frame]:
        """Frames of `status`; none where it cannot be encoded."""
        made: list[Frame] = self.attempt(sender.frames, status, default=[])
        return made

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

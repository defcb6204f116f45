"""Messages of the bench joined from frames: one frame may hold parts of several, one may need several."""

import math
from collections.abc import Mapping

from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.faults import FrameFault
from slipbench.protocol.codec.messages import BenchMessage
from slipbench.protocol.codec.wire import FramePlan, Part, Selection

Joined = tuple[str, BenchMessage, float]  # name, message, time of its oldest field (s)


class Assembly:
    """The last fields of messages that lie in several frames."""

    def __init__(self, codec: Codec) -> None:
        """Begin without any field."""
        self._codec = codec
        self._values: dict[str, dict[str, object]] = {}
        self._times: dict[str, dict[tuple[str, Selection], float]] = {}

    def take(self, plan: FramePlan, payload: bytearray, time: float) -> list[Joined] | FrameFault:
        """Messages that a frame received at `time` (s) completes, or the fault of a value in it."""
        words = plan.words(payload)
        if plan.only is not None:
            message = plan.only.unpack(words)
            if isinstance(message, FrameFault):
                return message
            return [] if message is None else [(plan.only.name, message, time)]  # type: ignore[list-item]
        found = []
        for part in plan.parts:
            content = part.unpack(words)
            if isinstance(content, FrameFault):
                return content
            if content is not None:
                found.append((part, content))
        joined = []
        for part, content in found:
            if not isinstance(content, Mapping):
                joined.append((part.name, content, time))
            elif (complete := self._join(part, content, time)) is not None:
                joined.append(complete)
        return joined

    def _join(self, part: Part, content: Mapping[str, object], time: float) -> Joined | None:
        """Message with the last fields of its other frames; None while some have never come.

        A message of several frames has no time of its own.
        """
        values = self._values.setdefault(part.name, dict(part.constants))
        times = self._times.setdefault(part.name, {})
        values.update(content)
        times[part.message.name, part.selection] = time
        if len(times) < len(self._codec.parts(part.name)):
            return None
        if "time" in values:
            values["time"] = math.nan
        return part.name, part.kind(**values), min(times.values())

"""Messages of the bench joined from frames: one frame may hold parts of several, one may need several."""

import math
from collections.abc import Iterator, Mapping

from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.faults import FrameFault
from slipbench.protocol.codec.messages import BenchMessage
from slipbench.protocol.codec.wire import FramePlan, Part

Joined = tuple[str, BenchMessage, float]  # name, message, time of its oldest field (s)


class Assembly:
    """The last fields of messages that lie in several frames."""

    def __init__(self, codec: Codec) -> None:
        """Begin without any field."""
        self._codec = codec
        self._values: dict[str, dict[str, object]] = {}
        self._times: dict[str, dict[str, float]] = {}

    def take(self, plan: FramePlan, payload: bytearray, time: float) -> list[Joined] | FrameFault:
        """Messages that are whole with a frame that arrived at `time` (s); or the fault of a value in it."""
        words = plan.words(payload)
        if len(plan.parts) == 1 and plan.parts[0].whole:
            only = plan.parts[0].unpack(words)
            if isinstance(only, FrameFault):
                return only
            return [] if only is None else [(plan.parts[0].name, only, time)]  # type: ignore[list-item]
        joined: list[Joined] = []
        fields: list[tuple[Part, Mapping[str, object]]] = []
        for part in plan.parts:
            content = part.unpack(words)
            if isinstance(content, FrameFault):
                return content
            if isinstance(content, dict):
                fields.append((part, content))
            elif content is not None:
                joined.append((part.name, content, time))  # type: ignore[arg-type]
        for part, content in fields:
            joined += self._join(part, plan.message.name, content, time)
        return joined

    def _join(
        self, part: Part, carrier: str, content: Mapping[str, object], time: float
    ) -> Iterator[Joined]:
        """Message with the last fields of its other frames, once all have come.

        A message of several frames has no time of its own.
        """
        values = self._values.setdefault(part.name, dict(part.constants))
        times = self._times.setdefault(part.name, {})
        values.update(content)
        times[carrier] = time
        if len(times) < len(self._codec.carriers(part.name)):
            return
        if "time" in values:
            values["time"] = math.nan
        yield part.name, part.kind(**values), min(times.values())

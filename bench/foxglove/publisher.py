"""Publishes portions of a recording: each frame once at the topic of its message, then the quantities."""

from collections.abc import Iterator

import numpy as np

from slipbench.bench.foxglove.quantities import Message, quantities, quantity_schemas
from slipbench.bench.foxglove.server import Server
from slipbench.bench.loop.clock import SECOND
from slipbench.bench.view.portion import Portion
from slipbench.bench.view.recorded_trial import RecordedTrial
from slipbench.protocol.database.layout import Database
from slipbench.protocol.export.json_messages import Tree, json_messages, message_schema, topic_of
from slipbench.protocol.logs.decode import sort_log
from slipbench.protocol.logs.frame_log import FrameLog

STEP_BACK = SECOND  # ns; less is frames of one instant that were recorded in turn


def message_schemas(database: Database, buses: tuple[str, ...]) -> dict[str, Tree]:
    """JSON Schema of each message at its topic; a message without a bus may come on each."""
    return {
        topic_of(bus, message.name): message_schema(message)
        for message in database.messages
        for bus in ([message.bus] if message.bus else buses)
    }


class Publisher:
    """Publisher of one recording after another."""

    def __init__(self, server: Server) -> None:
        """Publish to the clients of `server`."""
        self._server = server
        self._recorded: RecordedTrial | None = None
        self.time = 0

    def begin(self, recorded: RecordedTrial) -> None:
        """Advertise the topics of a trial."""
        self._recorded = recorded
        frames = message_schemas(recorded.binding.database, recorded.buses)
        self._server.advertise({**frames, **quantity_schemas(recorded)})

    def publish(self, portion: Portion) -> None:
        """Publish what is new, in order of time."""
        if self._recorded is None:
            return
        topics = self._server.wanted()
        messages = [*self._frames(portion, topics)]
        messages += quantities(portion, self._recorded.plan.trial)
        messages.sort(key=lambda message: message[0])
        if not messages:
            return
        if messages[-1][0] < self.time - STEP_BACK:
            self._server.clear()
            self.time = 0
        for time, topic, data in messages:
            self._server.send(topic, time, data)
        self.time = max(self.time, messages[-1][0])
        self._server.set_time(self.time)

    def _frames(self, portion: Portion, topics: set[str]) -> Iterator[Message]:
        """Decoded frames at or after the begin of a portion, of the subscribed topics."""
        if portion.log is None or self._recorded is None:
            return
        log = _since(portion.log, portion.begin)
        names = {topic.rpartition("/")[2] for topic in topics}
        found, _ = json_messages(sort_log(log, self._recorded.binding.database), names)
        columns = (log.time_ns.tolist(), log.bus.tolist(), found)
        for time, bus, decoded in zip(*columns, strict=True):
            if decoded is not None:
                yield time, topic_of(log.buses[bus], decoded[0].name), decoded[1]


def _since(log: FrameLog, begin: int) -> FrameLog:
    """Frames at or after a time (ns)."""
    return log if log.time_ns[0] >= begin else log.select(np.flatnonzero(log.time_ns >= begin))

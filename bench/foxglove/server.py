"""Server of the Foxglove WebSocket protocol on this machine: topics, messages, time, playback control.

The library has no check of who connects, so the server is bound to the loopback address alone.
A client that is slow has a backlog of its own; when that is full, its oldest messages are dropped, and
all clients are warned. Nothing waits for a client.
"""

import json
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from slipbench.bench.view.access import DEFAULT_HOST, Address
from slipbench.protocol.errors import InputError
from slipbench.protocol.export.json_messages import Tree
from slipbench.protocol.extras import optional_library

BACKLOG = 1 << 17  # messages that wait for a client: 16 s of a bus at 8 000 frames/s
LIBRARY_LOG = "foxglove"
DROPPED = "outbox"  # in the library's line about a full backlog
TOO_SLOW = "a client is too slow: its oldest messages were dropped; the recording has them all"


@dataclass(frozen=True)
class ReplayState:
    """State of a replay: "Playing", "Paused" or "Ended", its time (ns), and whether it was set."""

    status: str
    time_ns: int
    speed: float
    seek: bool = False


def require_foxglove() -> None:
    """Check that the library of the stream is installed. Raises InputError."""
    optional_library("foxglove")


class Subscriptions:
    """Callbacks of the server, which the library calls in threads of its own.

    open    client and topic of each subscription, by their numbers
    count   subscriptions so far
    answer  controls a replay as a client requests, and gives its state
    """

    def __init__(self) -> None:
        self.open: set[tuple[int, int]] = set()
        self.count = 0
        self.answer: Callable[[Any], Any] = lambda _request: None

    def on_subscribe(self, client: Any, channel: Any) -> None:
        """Note a subscription."""
        self.open.add((client.id, channel.id))
        self.count += 1

    def on_unsubscribe(self, client: Any, channel: Any) -> None:
        """Forget a subscription."""
        self.open.discard((client.id, channel.id))

    def on_playback_control_request(self, request: Any) -> Any:
        """State of the replay after a request."""
        return self.answer(request)


class _DropWatch(logging.Handler):
    """Counts the library's lines about a full backlog: one in 30 s at most.

    They come from within a call to the library, which must not be called again from there.
    """

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.count = 0

    def emit(self, record: logging.LogRecord) -> None:
        self.count += DROPPED in record.getMessage()


class Server:
    """A running server."""

    def __init__(
        self, name: str, address: Address, playback: tuple[int, int] | None = None
    ) -> None:
        """Listen on the loopback address; at another port where the user chose none and it is in use.

        playback: time of the first and the last message of a replay (ns), which clients may control

        Raises InputError where the extra is missing or the port cannot be used.
        """
        self._library = optional_library("foxglove")
        self._parts: Any = optional_library("foxglove.websocket")
        self._context = self._library.Context()
        self._channels: dict[str, tuple[Tree, Any]] = {}
        self.subscriptions = Subscriptions()
        self._drops, self._warned = _DropWatch(), 0
        self._listen_to_library()
        self._running = self._start(name, address, playback)

    def _listen_to_library(self) -> None:
        log = logging.getLogger(LIBRARY_LOG)
        log.propagate = False
        log.setLevel(logging.INFO)
        log.addHandler(self._drops)
        self._library.set_log_level(logging.INFO)

    def _start(self, name: str, address: Address, playback: tuple[int, int] | None) -> Any:
        capable = self._parts.Capability
        options = {
            "name": name,
            "host": DEFAULT_HOST,
            "context": self._context,
            "server_listener": self.subscriptions,
            "capabilities": [capable.Time, *([capable.PlaybackControl] if playback else [])],
            "playback_time_range": playback,
            "message_backlog_size": BACKLOG,
        }
        try:
            return self._library.start_server(port=address.port, **options)
        except RuntimeError as cause:
            if address.chosen:
                raise _unusable(address, cause) from cause
        return self._library.start_server(port=0, **options)

    @property
    def url(self) -> str:
        """Address to open in an application."""
        return f"ws://{DEFAULT_HOST}:{self._running.port}"

    @property
    def subscribed(self) -> bool:
        """Whether a client has subscribed to a topic."""
        return bool(self.subscriptions.open)

    def advertise(self, schemas: Mapping[str, Tree]) -> None:
        """Offer these topics with their JSON Schemas, and no others."""
        for topic in [
            each for each, (schema, _) in self._channels.items() if schemas.get(each) != schema
        ]:
            self._channels.pop(topic)[1].close()
        for topic, schema in schemas.items():
            if topic not in self._channels:
                self._channels[topic] = schema, self._channel(topic, schema)

    def _channel(self, topic: str, tree: Tree) -> Any:
        schema = self._library.Schema(
            name=tree["title"], encoding="jsonschema", data=json.dumps(tree).encode()
        )
        return self._library.Channel(
            topic, message_encoding="json", schema=schema, context=self._context
        )

    def wanted(self) -> set[str]:
        """Topics to which a client has subscribed."""
        return {topic for topic, (_, channel) in self._channels.items() if channel.has_sinks()}

    def send(self, topic: str, time_ns: int, data: bytes) -> None:
        """Send a message at a time of the recording to those who have subscribed to its topic."""
        if topic in self._channels:
            self._channels[topic][1].log(data, log_time=time_ns)

    def set_time(self, time_ns: int) -> None:
        """Send the time of the recording, and a warning where messages were dropped since the last one."""
        self._running.broadcast_time(time_ns)
        if self._drops.count > self._warned:
            self._warned = self._drops.count
            self.warn(TOO_SLOW)

    def warn(self, text: str) -> None:
        """Show a warning in all clients."""
        self._running.publish_status(text, self._library.StatusLevel.Warning, text)

    def withdraw(self, text: str) -> None:
        """Remove a warning in all clients."""
        self._running.remove_status([text])

    def plays(self, request: Any) -> bool:
        """Whether a request of a client is to play, and not to pause."""
        return bool(request.playback_command == self._parts.PlaybackCommand.Play)

    def playback_state(self, state: ReplayState, request: str | None = None) -> Any:
        """State of the replay as the library has it. request: the request's identifier."""
        status = getattr(self._parts.PlaybackStatus, state.status)
        return self._parts.PlaybackState(status, state.time_ns, state.speed, state.seek, request)

    def report(self, state: ReplayState) -> None:
        """Send the state of the replay to all clients."""
        self._running.broadcast_playback_state(self.playback_state(state))

    def clear(self) -> None:
        """Make all clients forget what they have received: time steps back."""
        self._running.clear_session()

    def stop(self) -> None:
        """Disconnect all clients."""
        logging.getLogger(LIBRARY_LOG).removeHandler(self._drops)
        self._running.stop()


def _unusable(address: Address, cause: Exception) -> InputError:
    return InputError(
        "the Foxglove stream cannot use this port",
        where=f"{DEFAULT_HOST}:{address.port}",
        found=str(cause),
        remedy="give another one with --foxglove-port PORT, or leave it out: a free port is taken",
    )

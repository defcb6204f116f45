"""A client of the Foxglove WebSocket protocol, as its specification has it; the SDK has no part in it."""

import json
import struct
from contextlib import contextmanager

from websockets.sync.client import connect

SUBPROTOCOL = "foxglove.sdk.v1"
MESSAGE, TIME, PLAYBACK = 1, 2, 5  # binary operations of the server
CONTROL = 3  # of the client
PLAYING, PAUSED, ENDED = 0, 1, 3
PLAY, PAUSE = 0, 1


class Client:
    """What one client has received: messages by topic, times, states of the replay, warnings."""

    def __init__(self, socket):
        self._socket = socket
        self.channels, self.topics, self.messages = {}, {}, {}
        self.order, self.times, self.states, self.requests = [], [], [], []
        self.statuses, self.info, self.sessions = [], {}, 0

    def schema(self, topic):
        return json.loads(self.channels[topic]["schema"])

    def receive(self, seconds=1.0):
        """Receive until nothing comes for a time."""
        while True:
            try:
                data = self._socket.recv(timeout=seconds)
            except TimeoutError:
                return self
            self._text(json.loads(data)) if isinstance(data, str) else self._binary(data)

    def until(self, there, patience=60.0):
        """Receive until a condition holds."""
        while not there():
            data = self._socket.recv(timeout=patience)
            self._text(json.loads(data)) if isinstance(data, str) else self._binary(data)
        return self

    def subscribe(self, *topics):
        """Subscribe to topics; to all without one."""
        chosen = [self.channels[each] for each in topics or list(self.channels)]
        self.topics |= {each["id"]: each["topic"] for each in chosen}
        subscriptions = [{"id": each["id"], "channelId": each["id"]} for each in chosen]
        self._socket.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))

    def unsubscribe(self):
        self._socket.send(json.dumps({"op": "unsubscribe", "subscriptionIds": list(self.topics)}))

    def control(self, command, seek_ns=None, speed=1.0, name="request"):
        """Ask the server to play, pause or seek."""
        seek = struct.pack("<BQ", seek_ns is not None, seek_ns or 0)
        name = name.encode()
        head = struct.pack("<BBf", CONTROL, command, speed)
        self._socket.send(head + seek + struct.pack("<I", len(name)) + name)

    def values(self, topic):
        """Time and JSON of each message of a topic."""
        return [(time, json.loads(data)) for time, data in self.messages.get(topic, [])]

    def _text(self, tree):
        match tree["op"]:
            case "serverInfo":
                self.info, self.sessions = tree, self.sessions + 1
            case "advertise":
                self.channels |= {each["topic"]: each for each in tree["channels"]}
            case "unadvertise":
                gone = set(tree["channelIds"])
                kept = self.channels.items()
                self.channels = {name: each for name, each in kept if each["id"] not in gone}
            case "status":
                self.statuses.append(tree["message"])

    def _binary(self, data):
        if data[0] == MESSAGE:
            number, time = struct.unpack_from("<IQ", data, 1)
            self.messages.setdefault(self.topics[number], []).append((time, data[13:]))
            self.order.append(time)
        elif data[0] == TIME:
            self.times.append(struct.unpack_from("<Q", data, 1)[0])
        elif data[0] == PLAYBACK:
            *state, length = struct.unpack_from("<BQf?I", data, 1)
            self.states.append(tuple(state))
            self.requests.append(data[19 : 19 + length].decode())


@contextmanager
def client(url, **options):
    """A connected client, which knows the topics."""
    options = {"open_timeout": 60, "close_timeout": 0.3, "max_size": None, **options}
    with connect(url, subprotocols=[SUBPROTOCOL], **options) as socket:
        yield Client(socket).receive(0.2)

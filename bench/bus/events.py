"""What happens on a wire, as its nodes learn of it."""

from enum import Enum
from typing import NamedTuple

from slipbench.bench.bus.counters import Counters
from slipbench.bench.bus.frame import Frame
from slipbench.bench.bus.node import Node


class Cause(Enum):
    """What a node is told beside frames."""

    BIT = "a bit of the frame was destroyed"
    COLLISION = "another node sent another frame with this identifier"
    UNACKNOWLEDGED = "no other node heard the frame"
    STATE = "the error counters fell"
    RESTARTED = "the node is on the bus again"


class Delivery(NamedTuple):
    """A frame at a node; `own`: the sender learns that its frame was sent."""

    time_ns: int
    node: Node
    frame: Frame
    own: bool


class Notice(NamedTuple):
    """An error that a node saw, or a change of its state; `dropped` frames of its own are gone."""

    time_ns: int
    node: Node
    cause: Cause
    counters: Counters
    sending: bool
    dropped: int = 0


Event = Delivery | Notice

"""Events on the wire, as its nodes receive them."""

from enum import Enum
from typing import NamedTuple

from slipbench.bench.bus.counters import Counters
from slipbench.bench.bus.frame import Frame
from slipbench.bench.bus.node import Node


class Cause(Enum):
    """Cause of a notice to a node."""

    BIT = "a bit of the frame was destroyed"
    COLLISION = "another node sent another frame with this identifier"
    UNACKNOWLEDGED = "no other node acknowledged the frame"
    STATE = "the error counters fell"
    RESTARTED = "the node is on the bus again"


class Delivery(NamedTuple):
    """Reception of a frame by a node; own: confirmation to the sender that its frame was sent."""

    time_ns: int
    node: Node
    frame: Frame
    own: bool


class Notice(NamedTuple):
    """Error at a node, or change of its state; dropped: number of its own frames that were lost."""

    time_ns: int
    node: Node
    cause: Cause
    counters: Counters
    sending: bool
    dropped: int = 0


Event = Delivery | Notice

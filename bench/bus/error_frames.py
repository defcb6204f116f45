"""What SocketCAN tells in an error frame: its class and eight bytes of details (linux/can/error.h).

candump, python-can and the gateway read it the same on every interface.
"""

from slipbench.bench.bus.counters import Confinement, Counters
from slipbench.bench.bus.events import Cause

CONTROLLER, PROTOCOL, NO_ACK, BUS_OFF, BUS_ERROR, RESTARTED, COUNTERS = (
    0x04,
    0x08,
    0x20,
    0x40,
    0x80,
    0x100,
    0x200,
)
WARNED, PASSIVE, ACTIVE = (0x08, 0x04), (0x20, 0x10), 0x40  # transmit and receive; data[1]
OVERFLOW = 0x01  # data[1]: the receive buffer was full
BIT_ERROR, SENDING = 0x04, 0x80  # data[2]: a bit was not as sent; while transmitting
CLASSES = {
    Cause.BIT: PROTOCOL | BUS_ERROR,
    Cause.COLLISION: PROTOCOL | BUS_ERROR,
    Cause.UNACKNOWLEDGED: NO_ACK | BUS_ERROR,
    Cause.STATE: CONTROLLER,
    Cause.RESTARTED: RESTARTED | CONTROLLER,
}


def error_content(cause: Cause, counters: Counters, sending: bool) -> tuple[int, bytes]:
    """Give class and details of SocketCAN's error frame."""
    state = counters.state
    controller = 0
    if state is Confinement.PASSIVE:
        controller = PASSIVE[counters.receive > counters.transmit]
    elif state is Confinement.WARNED:
        controller = WARNED[counters.receive > counters.transmit]
    elif cause in (Cause.STATE, Cause.RESTARTED):
        controller = ACTIVE
    identifier = CLASSES[cause] | COUNTERS
    identifier |= BUS_OFF if state is Confinement.OFF else 0
    identifier |= CONTROLLER if controller else 0
    protocol = BIT_ERROR if cause in (Cause.BIT, Cause.COLLISION) else 0
    protocol |= SENDING if sending and protocol else 0
    told = (min(counters.transmit, 255), min(counters.receive, 255))
    return identifier, bytes((0, controller, protocol, 0, 0, 0, *told))

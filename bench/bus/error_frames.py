"""Error frames in the format of SocketCAN: error class and eight bytes (linux/can/error.h).

candump, python-can and the gateway then read error frames of all interfaces in the same way.
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
WARNED, PASSIVE, ACTIVE = (0x08, 0x04), (0x20, 0x10), 0x40  # data[1]; TEC and REC
OVERFLOW = 0x01  # data[1]: the receive buffer was full
BIT_ERROR, SENDING = 0x04, 0x80  # data[2]: bit error; while transmitting
CLASSES = {
    Cause.BIT: PROTOCOL | BUS_ERROR,
    Cause.COLLISION: PROTOCOL | BUS_ERROR,
    Cause.UNACKNOWLEDGED: NO_ACK | BUS_ERROR,
    Cause.STATE: CONTROLLER,
    Cause.RESTARTED: RESTARTED | CONTROLLER,
}


def error_content(cause: Cause, counters: Counters, sending: bool) -> tuple[int, bytes]:
    """Error class and eight data bytes of SocketCAN's error frame. sending: error of a sender."""
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
    counts = (min(counters.transmit, 255), min(counters.receive, 255))
    return identifier, bytes((0, controller, protocol, 0, 0, 0, *counts))

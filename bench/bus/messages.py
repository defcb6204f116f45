"""python-can's messages and the wire's frames, each as the other; errors as SocketCAN tells them.

An error frame on SocketCAN has its class in the identifier and details in eight data bytes
(linux/can/error.h); candump, python-can and the gateway read it the same on every interface.
"""

import can

from bench.bus.counters import Confinement, Counters
from bench.bus.frame import Frame
from bench.bus.wire import Cause, Notice

CONTROLLER, PROTOCOL, NO_ACK, BUS_OFF, BUS_ERROR, RESTARTED, COUNTERS = (
    0x04, 0x08, 0x20, 0x40, 0x80, 0x100, 0x200,
)  # fmt: skip
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


def frame_of(message: can.Message) -> Frame:
    """Give the frame that a message asks to be sent."""
    return Frame(
        message.arbitration_id,
        bytes(message.data),
        message.is_extended_id,
        message.is_fd,
        message.bitrate_switch,
        message.error_state_indicator,
        message.dlc if message.is_remote_frame else None,
    )


def message_of(frame: Frame, timestamp: float, own: bool, channel: str | None) -> can.Message:
    """Give a frame as python-can does; `timestamp` in s."""
    return can.Message(
        timestamp,
        frame.identifier,
        frame.extended,
        frame.requested is not None,
        False,
        channel,
        frame.requested,
        frame.data,
        frame.fd,
        not own,
        frame.switches_rate,
        frame.error_passive,
    )


def error_of(notice: Notice, timestamp: float, channel: str | None) -> can.Message:
    """Give what a node was told beside frames as an error frame."""
    identifier, data = error_content(notice.cause, notice.counters, notice.sending)
    return error_message(identifier, data, timestamp, channel)


def error_message(
    identifier: int, data: bytes, timestamp: float, channel: str | None
) -> can.Message:
    """Make an error frame of its class and details."""
    return can.Message(
        timestamp, identifier, is_extended_id=False, is_error_frame=True, channel=channel,
        dlc=8, data=data,
    )  # fmt: skip


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

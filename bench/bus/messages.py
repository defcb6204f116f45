"""python-can's messages and the wire's frames, each as the other; errors as SocketCAN has them."""

import can

from slipbench.bench.bus.counters import Confinement
from slipbench.bench.bus.error_frames import error_content
from slipbench.bench.bus.events import Notice
from slipbench.bench.bus.frame import Frame, checked

STATES = {
    Confinement.ACTIVE: can.BusState.ACTIVE,
    Confinement.WARNED: can.BusState.ACTIVE,
    Confinement.PASSIVE: can.BusState.PASSIVE,
    Confinement.OFF: can.BusState.ERROR,
}


def frame_of(message: can.Message) -> Frame:
    """Give the frame that a message asks to be sent; raises ValueError for what is none."""
    return checked(
        Frame(
            message.arbitration_id,
            bytes(message.data),
            message.is_extended_id,
            message.is_fd,
            message.bitrate_switch,
            message.error_state_indicator,
            message.dlc if message.is_remote_frame else None,
        )
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
        timestamp,
        identifier,
        is_extended_id=False,
        is_error_frame=True,
        channel=channel,
        dlc=8,
        data=data,
    )

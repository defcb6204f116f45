"""Conversion between messages of python-can and frames of the wire; errors as in SocketCAN."""

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
    """Frame of a message. Raises ValueError where no CAN controller can send it."""
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
    """Message of a frame. timestamp: s; own: sent by the receiver itself."""
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
    """Error frame of a notice to a node. timestamp: s."""
    identifier, data = error_content(notice.cause, notice.counters, notice.sending)
    return error_message(identifier, data, timestamp, channel)


def error_message(
    identifier: int, data: bytes, timestamp: float, channel: str | None
) -> can.Message:
    """Error frame with a class (identifier) and eight data bytes. timestamp: s."""
    return can.Message(
        timestamp,
        identifier,
        is_extended_id=False,
        is_error_frame=True,
        channel=channel,
        dlc=8,
        data=data,
    )

"""Opening a python-can bus: room for what is not read at once, and errors that say what to do."""

import contextlib
import errno
import socket
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import can
from can.interfaces.socketcan import SocketcanBus

from slipbench.protocol.errors import InputError

REMEDIES = {
    "socketcan": "bring the interface up: ip link set {channel} up type can bitrate {bitrate}",
    "pcan": "install PEAK's PCAN-Basic and plug the adapter in; channels are PCAN_USBBUS1, ...",
    "slipbench": "nothing else may use the channel at another bit rate; Linux only",
    "kvaser": "install Kvaser's CANlib and plug the adapter in; channels are 0, 1, ...",
}

BIT_RATE_SET_ELSEWHERE = ("socketcan", "virtual")  # by `ip link`, or not at all

LONGEST_NAME = 15  # characters of a bus's name in a record: IFNAMSIZ of <net/if.h>

QUEUE_LENGTH = 16  # frames: what a node sends within 3 ms; older ones are better not sent at all

# Bytes of the kernel's memory for frames that were not read yet, as it counts them itself: some
# 760 a frame. The default of 208 KiB is full after 280 frames, 70 ms of a bus at 60 % load, and
# what comes then is lost without a word; this holds more than 2 s.
RECEIVE_BUFFER = 8 << 20
SO_RCVBUFFORCE = 33  # of <asm/socket.h>: beyond net.core.rmem_max, for who may administer networks


@dataclass(frozen=True)
class BusAddress:
    """Where a bus is: python-can's interface and channel, its bit rate (bit/s), and CAN FD."""

    interface: str
    channel: str
    bitrate: int = 1_000_000
    fd: bool = False

    @property
    def name(self) -> str:
        """Name the bus as recordings do: without spaces, no longer than a Linux interface is."""
        name = "".join(c if c.isalnum() else "_" for c in self.channel) or self.interface
        return name[-LONGEST_NAME:]


def open_bus(address: BusAddress, receive_own_messages: bool, in_order: bool = False) -> can.BusABC:
    """Open the bus; raises InputError with the remedy where it cannot be.

    in_order  frames leave as they were sent, on the virtual bus too, where a node otherwise offers
              its most urgent one first; SocketCAN's queue keeps order, other hardware may not
    """
    channel: str | int = address.channel
    if address.interface == "kvaser" and address.channel.isdigit():
        channel = int(address.channel)
    options: dict[str, Any] = (
        {} if address.interface in BIT_RATE_SET_ELSEWHERE else {"bitrate": address.bitrate}
    )
    if address.fd:
        options["fd"] = True
    # On the virtual bus one node speaks for several devices, as does a gateway.
    if address.interface == "slipbench" and not in_order:
        options |= {"urgent_first": True, "queue_length": QUEUE_LENGTH}
    try:
        bus = can.Bus(
            interface=address.interface,
            channel=channel,
            receive_own_messages=receive_own_messages,
            **options,
        )
    except (can.CanError, OSError, ImportError, NameError, ValueError, TypeError) as cause:
        remedy = REMEDIES.get(address.interface, "see python-can's page on this interface")
        if isinstance(cause, OSError) and cause.errno == errno.EAFNOSUPPORT:
            remedy = "this kernel has no CAN; without hardware, leave --interface out"
        raise InputError(
            f"the CAN bus cannot be opened: interface {address.interface!r}, "
            f"channel {address.channel!r}",
            found=f"{type(cause).__name__}: {cause}",
            remedy=remedy.format(channel=address.channel, bitrate=address.bitrate),
        ) from cause
    widen(bus)
    return bus


def interface_down(fault: can.CanError) -> bool:
    """Tell whether the interface itself is no more, or down; a queue that is full has room later.

    Linux reports it once, to whichever call comes next: one that sends may be the only one told.
    """
    return fault.error_code in (errno.ENETDOWN, errno.ENODEV, errno.ENXIO)


@contextlib.contextmanager
def bus_failure_as_input_error(address: BusAddress) -> Iterator[None]:
    """Raise InputError with the remedy where the bus at `address` fails within the block."""
    try:
        yield
    except can.CanError as cause:
        raise InputError(
            f"the CAN bus is gone: interface {address.interface!r}, channel {address.channel!r}",
            found=f"{type(cause).__name__}: {cause}",
            remedy="see to the interface, and start again",
        ) from cause


def widen(bus: can.BusABC) -> None:
    """Ask the kernel for room for `RECEIVE_BUFFER` bytes of frames; SocketCAN only."""
    if not isinstance(bus, SocketcanBus):
        return
    for option in (SO_RCVBUFFORCE, socket.SO_RCVBUF):
        with contextlib.suppress(OSError):  # what was granted is asked for, and told
            bus.socket.setsockopt(socket.SOL_SOCKET, option, RECEIVE_BUFFER // 2)  # it doubles it
            return


def receive_buffer(bus: can.BusABC) -> int | None:
    """Tell how many bytes of frames the kernel keeps for this bus; None where it is not asked."""
    if not isinstance(bus, SocketcanBus):
        return None
    return bus.socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)


def stamps_wall_time(bus: can.BusABC) -> bool:
    """Tell whether this bus stamps frames with the wall clock, as Linux does."""
    return isinstance(bus, SocketcanBus)

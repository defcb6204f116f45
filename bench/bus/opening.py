"""Opening a python-can bus: receive buffer, transmit queue, and errors with their remedies."""

import contextlib
import errno
import socket
from collections.abc import Iterator, Sequence
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

QUEUE_LENGTH = 16  # frames: what a node sends within 3 ms; older frames should not be sent at all

# Bytes of kernel memory for frames that were not read yet, as the kernel counts them: about 760 for
# each frame. The default of 208 KiB is full after 280 frames, 70 ms of a bus at 60 % load; further
# frames are lost without an error. This size holds more than 2 s.
RECEIVE_BUFFER = 8 << 20
SO_RCVBUFFORCE = 33  # of <asm/socket.h>: above net.core.rmem_max, with the right CAP_NET_ADMIN


@dataclass(frozen=True)
class BusAddress:
    """Address of a bus: python-can's interface and channel, bit rate (bit/s), CAN FD or not.

    bus: its name in the binding; "" for the only bus
    """

    interface: str
    channel: str
    bitrate: int = 1_000_000
    fd: bool = False
    bus: str = ""

    @property
    def name(self) -> str:
        """Name of the bus in recordings: no spaces, at most as long as a Linux interface name."""
        if self.bus:
            return self.bus
        name = "".join(c if c.isalnum() else "_" for c in self.channel) or self.interface
        return name[-LONGEST_NAME:]


def open_bus(address: BusAddress, receive_own_messages: bool, in_order: bool = False) -> can.BusABC:
    """Open bus. Raises InputError with the remedy where it cannot be opened.

    receive_own_messages  the bus also receives the frames that it sent
    in_order  frames are sent in order on the virtual bus too, where a node otherwise sends its most
              urgent frame first; SocketCAN keeps the order, other hardware may not
    """
    channel: str | int = address.channel
    if address.interface == "kvaser" and address.channel.isdigit():
        channel = int(address.channel)
    options: dict[str, Any] = (
        {} if address.interface in BIT_RATE_SET_ELSEWHERE else {"bitrate": address.bitrate}
    )
    if address.fd:
        options["fd"] = True
    # On the virtual bus one node sends the messages of several devices, as a gateway does.
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
            f"the CAN bus cannot be opened: {shown([address])}",
            found=f"{type(cause).__name__}: {cause}",
            remedy=remedy.format(channel=address.channel, bitrate=address.bitrate),
        ) from cause
    enlarge_receive_buffer(bus)
    return bus


@contextlib.contextmanager
def open_buses(
    addresses: Sequence[BusAddress], receive_own_messages: bool
) -> Iterator[tuple[can.BusABC, ...]]:
    """Buses, open until the block ends. Raises InputError where one cannot be opened, see `open_bus`."""
    with contextlib.ExitStack() as stack:
        yield tuple(
            stack.enter_context(open_bus(address, receive_own_messages)) for address in addresses
        )


def as_sequence(bus: can.BusABC | Sequence[can.BusABC]) -> Sequence[can.BusABC]:
    """Buses in the order of their numbers, where one stands for the only one."""
    return bus if isinstance(bus, Sequence) else (bus,)


def shown(addresses: Sequence[BusAddress]) -> str:
    """Interface and channels of buses, for people."""
    channels = ", ".join(repr(address.channel) for address in addresses)
    plural = "s" if len(addresses) > 1 else ""
    return f"interface {addresses[0].interface!r}, channel{plural} {channels}"


def interface_down(fault: can.CanError) -> bool:
    """Whether the error means that the interface is down or removed, and not a full queue.

    Linux reports this once, to the next call: it may be only a call that sends.
    """
    return fault.error_code in (errno.ENETDOWN, errno.ENODEV, errno.ENXIO)


@contextlib.contextmanager
def bus_failure_as_input_error(addresses: Sequence[BusAddress]) -> Iterator[None]:
    """Raises InputError with the remedy where a CanError ends the block."""
    try:
        yield
    except can.CanError as cause:
        raise InputError(
            f"the CAN bus failed: {shown(addresses)}",
            found=f"{type(cause).__name__}: {cause}",
            remedy="check the interface, and start again",
        ) from cause


def enlarge_receive_buffer(bus: can.BusABC) -> None:
    """Request a receive buffer of `RECEIVE_BUFFER` bytes from the kernel; SocketCAN only."""
    if not isinstance(bus, SocketcanBus):
        return
    for option in (SO_RCVBUFFORCE, socket.SO_RCVBUF):
        with contextlib.suppress(OSError):  # `receive_buffer` reads what was granted
            bus.socket.setsockopt(socket.SOL_SOCKET, option, RECEIVE_BUFFER // 2)  # it doubles it
            return


def receive_buffer(bus: can.BusABC) -> int | None:
    """Size of the kernel's receive buffer of this bus, bytes; None except for SocketCAN."""
    if not isinstance(bus, SocketcanBus):
        return None
    return bus.socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)


def stamps_wall_time(bus: can.BusABC) -> bool:
    """Whether the time stamps of this bus are those of the wall clock, as in Linux."""
    return isinstance(bus, SocketcanBus)

"""Opening a python-can bus, with errors that say what to do about them."""

import errno
from dataclasses import dataclass
from typing import Any

import can

from protocol.errors import InputError

REMEDIES = {
    "socketcan": "bring the interface up: ip link set {channel} up type can bitrate {bitrate}",
    "pcan": "install PEAK's PCAN-Basic and plug the adapter in; channels are PCAN_USBBUS1, ...",
    "kvaser": "install Kvaser's CANlib and plug the adapter in; channels are 0, 1, ...",
}

BIT_RATE_SET_ELSEWHERE = ("socketcan", "virtual")  # by `ip link`, or not at all


@dataclass(frozen=True)
class BusAddress:
    """Where a bus is: python-can's interface and channel, its bit rate (bit/s), and CAN FD."""

    interface: str
    channel: str
    bitrate: int = 1_000_000
    fd: bool = False

    @property
    def name(self) -> str:
        """Name the bus as recordings do: without spaces."""
        return "".join(c if c.isalnum() else "_" for c in self.channel) or self.interface


def open_bus(address: BusAddress, hears_itself: bool) -> can.BusABC:
    """Open the bus; raises InputError with the remedy where it cannot be."""
    channel: str | int = address.channel
    if address.interface == "kvaser" and address.channel.isdigit():
        channel = int(address.channel)
    options: dict[str, Any] = (
        {} if address.interface in ("socketcan", "virtual") else {"bitrate": address.bitrate}
    )
    if address.fd:
        options["fd"] = True
    try:
        return can.Bus(
            interface=address.interface,
            channel=channel,
            receive_own_messages=hears_itself,
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

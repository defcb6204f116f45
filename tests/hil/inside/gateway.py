"""Rules of the kernel's CAN gateway, set with system calls, as cangw of can-utils sets them.

Starting a program takes the one processor of a user-mode kernel for longer than the bench waits for
the simulated vehicle. Numbers and structures: linux/can/gw.h, linux/rtnetlink.h, linux/netlink.h.
"""

import socket
import struct
from dataclasses import dataclass

_NEW_ROUTE, _DELETE_ROUTE, _ERROR = 24, 25, 2  # RTM_NEWROUTE, RTM_DELROUTE, NLMSG_ERROR
_REQUEST, _ACKNOWLEDGE = 0x01, 0x04  # NLM_F_REQUEST, NLM_F_ACK
_CAN_TO_CAN, _ECHO = 1, 1  # CGW_TYPE_CAN_CAN; CGW_FLAGS_CAN_ECHO: sockets of this machine hear them
_XOR, _SET, _SOURCE, _TARGET, _FILTER = 3, 4, 9, 10, 11  # CGW_MOD_XOR ... CGW_FILTER
_DATA = 4  # CGW_MOD_DATA: the modification changes the data of a frame
_STANDARD_IDENTIFIER = 0x7FF  # CAN_SFF_MASK


@dataclass(frozen=True)
class Rule:
    """Frames of one identifier pass from one interface to another.

    flipped   bits of the 8 data bytes that the gateway inverts; empty: none
    replaced  8 data bytes that it sends instead; empty: those of the frame
    """

    source: str
    target: str
    identifier: int
    flipped: bytes = b""
    replaced: bytes = b""

    def attributes(self) -> bytes:
        """Give the attributes of the netlink message."""
        source, target = map(socket.if_nametoindex, (self.source, self.target))
        chosen = struct.pack("=II", self.identifier, _STANDARD_IDENTIFIER)
        found = _attribute(_XOR, _modification(self.flipped)) if self.flipped else b""
        found += _attribute(_SET, _modification(self.replaced)) if self.replaced else b""
        found += _attribute(_FILTER, chosen)
        return found + _interface(_SOURCE, source) + _interface(_TARGET, target)


def add(rule: Rule) -> None:
    """Let the frames of a rule pass.

    Errors: OSError where the kernel refuses the rule.
    """
    _ask(_NEW_ROUTE, rule.attributes())


def remove(rule: Rule) -> None:
    """Let the frames of a rule pass no longer.

    Errors: OSError where there is no such rule.
    """
    _ask(_DELETE_ROUTE, rule.attributes())


def remove_all() -> None:
    """Remove each rule of each interface."""
    _ask(_DELETE_ROUTE, _interface(_SOURCE, 0) + _interface(_TARGET, 0))


def _ask(what: int, attributes: bytes) -> None:
    """Send struct nlmsghdr, struct rtcanmsg and attributes; the answer is a struct nlmsgerr."""
    body = struct.pack("=BBH", socket.AF_CAN, _CAN_TO_CAN, _ECHO) + attributes
    header = struct.pack("=IHHII", 16 + len(body), what, _REQUEST | _ACKNOWLEDGE, 1, 0)
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, socket.NETLINK_ROUTE) as kernel:
        kernel.send(header + body)
        answer = kernel.recv(4096)
    _, kind, *_, error = struct.unpack_from("=IHHIIi", answer)
    if kind != _ERROR or error:
        raise OSError(-error, f"the CAN gateway of the kernel refused message {what}")


def _attribute(kind: int, value: bytes) -> bytes:
    padding = bytes(-len(value) % 4)
    return struct.pack("=HH", 4 + len(value), kind) + value + padding


def _interface(kind: int, index: int) -> bytes:
    return _attribute(kind, struct.pack("=I", index))


def _modification(data: bytes) -> bytes:
    """Give struct cgw_frame_mod: struct can_frame and which of its elements change."""
    return struct.pack("=IB3x8sB", 0, len(data), data, _DATA)

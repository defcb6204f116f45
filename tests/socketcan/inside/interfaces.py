"""CAN interfaces that go down and up, by a system call."""

import fcntl
import socket
import struct

# linux/sockios.h and struct ifreq of linux/if.h: a name and flags.
GET_FLAGS, SET_FLAGS, IS_UP = 0x8913, 0x8914, 1
INTERFACE_REQUEST = "16sH22x"


def set_interface(name: str, *, up: bool) -> None:
    """Set an interface up or down, as `ip link set` does (netdevice(7), SIOCSIFFLAGS).

    Starting a program takes the one processor of a user-mode kernel for 40 ms: the vehicle would be
    silent before the interface is down.
    """
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as any_socket:
        request = struct.pack(INTERFACE_REQUEST, name.encode("ascii"), 0)
        answer = fcntl.ioctl(any_socket, GET_FLAGS, request)
        name_found, flags = struct.unpack(INTERFACE_REQUEST, answer)
        flags = flags | IS_UP if up else flags & ~IS_UP
        fcntl.ioctl(any_socket, SET_FLAGS, struct.pack(INTERFACE_REQUEST, name_found, flags))

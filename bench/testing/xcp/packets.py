"""Packets of XCP: commands as bytes, and the content of responses.

ASAM MCD-1 XCP 1.1, part 2, chapters 1.6 (commands) and 1.1.3 (identification field). The byte order
of numbers is that of the slave.
"""

import struct

from slipbench.protocol.errors import InputError

RESPONSE, ERROR, EVENT, SERVICE = 0xFF, 0xFE, 0xFD, 0xFC
CONNECT = bytes((0xFF, 0))
DISCONNECT = bytes((0xFE,))
GET_DAQ_PROCESSOR_INFO = bytes((0xDA,))
FREE_DAQ = bytes((0xD6,))
START_SELECTED, STOP_ALL = bytes((0xDD, 1)), bytes((0xDD, 0))

DYNAMIC = 0x01  # of DAQ_PROPERTIES
ERRORS = {
    0x00: "command processor synchronization",
    0x10: "command was not executed: busy",
    0x11: "data acquisition is running",
    0x12: "programming is running",
    0x20: "command is unknown",
    0x21: "syntax of the command is wrong",
    0x22: "a number of the command is out of range",
    0x23: "memory is write protected",
    0x24: "access to the memory is denied",
    0x25: "access is locked: seed and key are needed",
    0x26: "page is not valid",
    0x27: "mode is not valid",
    0x28: "segment is not valid",
    0x29: "sequence of commands is wrong",
    0x2A: "DAQ configuration is not valid",
    0x30: "memory overflow: too many measurements",
    0x31: "general error",
    0x32: "verify failed",
    0x33: "resource is temporarily not accessible",
}


def short_upload(order: str, size: int, extension: int, address: int) -> bytes:
    """Command that reads `size` bytes at an address. order: "<" or ">"."""
    return bytes((0xF4, size, 0, extension)) + struct.pack(f"{order}I", address)


def alloc_daq(order: str, lists: int) -> bytes:
    """Command that allocates a number of DAQ lists."""
    return bytes((0xD5, 0)) + struct.pack(f"{order}H", lists)


def alloc_odt(order: str, daq: int, count: int) -> bytes:
    """Command that allocates object descriptor tables in a DAQ list."""
    return bytes((0xD4, 0)) + struct.pack(f"{order}HB", daq, count)


def alloc_odt_entry(order: str, daq: int, odt: int, entries: int) -> bytes:
    """Command that allocates entries in an object descriptor table."""
    return bytes((0xD3, 0)) + struct.pack(f"{order}HBB", daq, odt, entries)


def set_daq_ptr(order: str, daq: int, odt: int, entry: int) -> bytes:
    """Command that selects the entry that is written next."""
    return bytes((0xE2, 0)) + struct.pack(f"{order}HBB", daq, odt, entry)


def write_daq(order: str, size: int, extension: int, address: int) -> bytes:
    """Command that writes an entry; the next one is selected then."""
    return bytes((0xE1, 0xFF, size, extension)) + struct.pack(f"{order}I", address)


def set_daq_list_mode(order: str, daq: int, event: int, prescaler: int = 1) -> bytes:
    """Command that binds a DAQ list to an event channel, without time stamps."""
    return bytes((0xE0, 0)) + struct.pack(f"{order}HHBB", daq, event, prescaler, 0)


def select_daq_list(order: str, daq: int) -> bytes:
    """Command that selects a DAQ list to be started; the response has its first PID."""
    return bytes((0xDE, 2)) + struct.pack(f"{order}H", daq)


def check(response: bytes, what: str) -> bytes:
    """The response itself. Raises InputError where it is an error or no response."""
    if response and response[0] == RESPONSE:
        return response
    code = response[1] if len(response) > 1 else -1
    raise InputError(
        f"the ECU refuses {what}",
        expected="a positive response (0xFF)",
        found=f"{response.hex(' ')}: {ERRORS.get(code, 'unknown error')}",
        remedy="check the A2L file and its version, and whether the ECU is unlocked",
    )

"""A small XCP slave on CAN: memory, SHORT_UPLOAD, dynamic DAQ lists at one event channel.

Written from ASAM MCD-1 XCP 1.1, part 2. It imitates no seed and key, no calibration and no time
stamps. `test_xcp.py` also drives it with pyxcp, where that is installed.
"""

import struct
from collections.abc import Callable

import can

COMMAND, ANSWER = 0x7E0, 0x7E8
EVENT_CHANNEL, EVENT_PERIOD = 2, 10  # ms
FIRST_PID = 4


class XcpSlave:
    """An ECU whose memory is a function of address and length, read at the time of the command."""

    def __init__(
        self,
        bus: can.BusABC,
        memory: Callable[[int, int], bytes | None],
        order: str = "<",
        most_entries: int = 100,
    ) -> None:
        self.bus, self.memory, self.order = bus, memory, order
        self.most_entries = most_entries
        self.connected = self.running = self.silent = False
        self.tables: list[list[tuple[int, int]]] = []  # (address, size) of each entry
        self.pointer = (0, 0)
        self.event = -1
        self.time = 0  # ms

    def tick(self, number: int, due: int) -> bool:
        """Answer commands, then send the DAQ list when its event is due."""
        self.time += 1
        while (message := self.bus.recv(0)) is not None:
            if message.arbitration_id == COMMAND and not self.silent:
                self.answer(bytes(message.data))
        if self.running and self.event == EVENT_CHANNEL and self.time % EVENT_PERIOD == 0:
            for odt, table in enumerate(self.tables):
                data = b"".join(self.memory(*entry) or b"" for entry in table)
                self.send(bytes((FIRST_PID + odt,)) + data)
        return True

    def send(self, data: bytes) -> None:
        self.bus.send(can.Message(arbitration_id=ANSWER, data=data, is_extended_id=False))

    def ok(self, data: bytes = b"") -> None:
        self.send(b"\xff" + data)

    def error(self, code: int) -> None:
        self.send(bytes((0xFE, code)))

    def word(self, data: bytes) -> int:
        return struct.unpack(f"{self.order}H", data)[0]

    def answer(self, data: bytes) -> None:
        command = data[0]
        if command != 0xFF and not self.connected:
            return
        handlers = {
            0xFF: self.connect,
            0xFE: self.disconnect,
            0xFD: lambda _: self.ok(bytes(5)),
            0xF4: self.short_upload,
            0xDA: lambda _: self.ok(struct.pack(f"{self.order}BHHBB", 0x11, 0, 3, 0, 0)),
            0xD6: self.free_daq,
            0xD5: lambda data: self.ok() if self.word(data[2:4]) == 1 else self.error(0x30),
            0xD4: self.alloc_odt,
            0xD3: self.alloc_odt_entry,
            0xE2: self.set_daq_ptr,
            0xE1: self.write_daq,
            0xE0: self.set_mode,
            0xDE: lambda _: self.ok(bytes((FIRST_PID,))),
            0xDD: self.start_stop,
        }
        handlers.get(command, lambda _: self.error(0x20))(data)

    def connect(self, _: bytes) -> None:
        self.connected = True
        mode = 0x00 if self.order == "<" else 0x01
        self.ok(struct.pack(f"{self.order}BBBHBB", 0x04, mode, 8, 8, 1, 1))

    def disconnect(self, _: bytes) -> None:
        self.connected = self.running = False
        self.ok()

    def short_upload(self, data: bytes) -> None:
        (address,) = struct.unpack(f"{self.order}I", data[4:8])
        found = self.memory(address, data[1])
        self.error(0x24) if found is None else self.ok(found)

    def free_daq(self, _: bytes) -> None:
        self.tables, self.running = [], False
        self.ok()

    def alloc_odt(self, data: bytes) -> None:
        self.tables = [[] for _ in range(data[4])]
        self.ok()

    def alloc_odt_entry(self, data: bytes) -> None:
        odt, count = data[4], data[5]
        if sum(map(len, self.tables)) + count > self.most_entries:
            self.error(0x30)
            return
        self.tables[odt] = [(0, 0)] * count
        self.ok()

    def set_daq_ptr(self, data: bytes) -> None:
        self.pointer = data[4], data[5]
        self.ok()

    def write_daq(self, data: bytes) -> None:
        odt, entry = self.pointer
        (address,) = struct.unpack(f"{self.order}I", data[4:8])
        self.tables[odt][entry] = (address, data[2])
        self.pointer = odt, entry + 1
        self.ok()

    def set_mode(self, data: bytes) -> None:
        event = self.word(data[4:6])
        if event != EVENT_CHANNEL:
            self.error(0x22)
            return
        self.event = event
        self.ok()

    def start_stop(self, data: bytes) -> None:
        self.running = data[1] == 1
        self.ok()

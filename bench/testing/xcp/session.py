"""Master of XCP on the bus of a test: connect, read once, poll, or receive DAQ lists.

It needs no thread and no clock of its own, so that it works on the simulated clock as in real time: a
response is handled when its frame arrives.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import can
import numpy as np

from slipbench.bench.loop.clock import SECOND
from slipbench.bench.loop.ring import EXTENDED as EXTENDED_FLAG
from slipbench.bench.testing.bench_bus import BenchBus
from slipbench.bench.testing.conditions import nearest
from slipbench.bench.testing.traffic import Floats, TrafficFrame
from slipbench.bench.testing.xcp import packets
from slipbench.bench.testing.xcp.a2l import EXTENDED, A2l, XcpMeasurement, read_a2l
from slipbench.protocol.errors import InputError

TIMEOUT = 0.1  # s for a response; t1 of the standard is 25 ms, and a busy ECU may take longer
ROOM = 7  # bytes of data in a packet on classic CAN


@dataclass
class Samples:
    """Samples of one measurement: times (s of the bus) and values in its unit."""

    of: XcpMeasurement
    times: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)

    def add(self, time: float, data: bytes) -> None:
        """Append the value of `data` at `time` (s)."""
        self.times.append(time)
        self.values.append(self.of.value(data))


class XcpSession:
    """Connection to one ECU."""

    def __init__(self, bus: BenchBus, a2l: A2l, node: can.BusABC) -> None:
        """Use the identifiers of the A2L file. Raises InputError where it has none."""
        if a2l.command is None or a2l.response is None:
            raise InputError(
                "the A2L file does not state the CAN identifiers",
                where=a2l.origin,
                expected="XCP_ON_CAN with CAN_ID_MASTER and CAN_ID_SLAVE",
                remedy="give them: xcp.connect(file, command=0x7E0, response=0x7E8)",
            )
        self.a2l, self.samples = a2l, dict[str, Samples]()
        self._bus, self._node, self._order = bus, node, "<"
        self._command, self._response = a2l.command, a2l.response
        self._answer: tuple[float, bytes] | None = None  # time (s), packet
        self._daq: dict[int, list[XcpMeasurement]] = {}  # PID -> measurements in it
        self._polled: list[XcpMeasurement] = []
        self._requested: tuple[float, XcpMeasurement] | None = None  # time (s), of a poll
        self._trouble = ""
        bus.watch(self._receive)

    # Packets

    def _send(self, packet: bytes) -> None:
        self._node.send(
            can.Message(
                arbitration_id=self._command & ~EXTENDED,
                is_extended_id=bool(self._command & EXTENDED),
                data=packet.ljust(8, b"\0"),
            )
        )

    def _receive(self, frame: TrafficFrame) -> None:
        extended = EXTENDED if frame.flags & EXTENDED_FLAG else 0
        if frame.identifier | extended != self._response or not frame.data:
            return
        now, kind = self._bus.traffic.seconds(frame), frame.data[0]
        if kind in self._daq:
            self._received_daq(now, frame.data)
        elif kind in (packets.RESPONSE, packets.ERROR):
            self._answer = (now, frame.data)
            if self._requested is not None:
                self._received_poll(now, frame.data)

    def request(self, packet: bytes, what: str) -> bytes:
        """Response to a command; time passes until it arrives.

        Raises InputError where the ECU refuses the command, or does not answer in time.
        """
        self._answer = None
        self._send(packet)
        latest = self._bus.line.now_ns() + round(TIMEOUT * SECOND)
        self._bus.run_until_ns(latest, lambda: self._answer is not None)
        if self._answer is None:
            raise InputError(
                f"the ECU does not answer: {what}",
                expected=f"a frame {self._response & ~EXTENDED:#x} within {TIMEOUT * 1e3:g} ms",
                found="none",
                remedy="check the identifiers, the bit rate, and whether the ECU runs",
            )
        return packets.check(self._answer[1], what)

    def connect(self) -> None:
        """Begin the session. Raises InputError where the ECU refuses it or does not answer."""
        response = self.request(packets.CONNECT, "CONNECT")
        self._order = ">" if response[2] & 1 else "<"
        granularity = 1 << (response[2] >> 1 & 3)
        if granularity != 1:
            raise InputError(
                "the ECU counts addresses in words",
                expected="address granularity of 1 byte",
                found=f"{granularity} bytes",
            )

    def disconnect(self) -> None:
        """Stop all measurements and end the session. Raises InputError where the ECU refuses it."""
        self._polled = []
        if self._daq:
            self._daq = {}
            self.request(packets.STOP_ALL, "START_STOP_SYNCH")
        self.request(packets.DISCONNECT, "DISCONNECT")
        self._bus.unwatch(self._receive)

    # Measurements

    def measurement(self, name: str) -> XcpMeasurement:
        """Measurement of the A2L file. Raises InputError with the nearest names where there is none."""
        if name not in self.a2l.measurements:
            raise InputError(
                f"the A2L file has no measurement {name!r}",
                where=self.a2l.origin,
                remedy=nearest(name, self.a2l.measurements),
            )
        found = self.a2l.measurements[name]
        if found.size > ROOM:
            raise InputError(
                f"measurement {name} does not fit into one packet",
                expected=f"at most {ROOM} bytes",
                found=f"{found.size} bytes",
            )
        return found

    def read(self, name: str) -> float:
        """Present value of a measurement, in its unit. Raises InputError."""
        if self._polled:
            raise InputError(
                "a value cannot be read while others are polled",
                expected="either xcp.read or xcp.poll; DAQ lists run beside both",
                found=", ".join(each.name for each in self._polled),
            )
        of = self.measurement(name)
        packet = packets.short_upload(self._order, of.size, of.extension, of.address)
        return of.value(self.request(packet, f"SHORT_UPLOAD of {name}")[1 : 1 + of.size])

    def trace(self, name: str) -> tuple[Floats, Floats]:
        """Times (s) and values of a recorded measurement, in its unit, shape (n,) each."""
        samples = self.samples[name]
        return np.array(samples.times), np.array(samples.values)

    def poll(self, names: Sequence[str], period: float | str) -> None:
        """Read measurements one after the other, the whole list every `period` (s).

        The time of a value is that of its response. Raises InputError for an unknown name.
        """
        self._polled = [self.measurement(name) for name in names]
        self.samples |= {of.name: Samples(of) for of in self._polled}
        self._bus.every(period, self._poll)

    def _poll(self, number: int, due: int) -> bool:
        if not self._polled or self._trouble:
            return False
        if self._requested is not None:  # the last list is not through
            since, of = self._requested
            if self._bus.now - since > TIMEOUT:
                self._trouble = f"XCP: no response to SHORT_UPLOAD of {of.name} at {since:.4f} s"
            return not self._trouble
        self._ask(self._polled[0])
        return True

    def _ask(self, of: XcpMeasurement) -> None:
        self._requested = (self._bus.now, of)
        self._send(packets.short_upload(self._order, of.size, of.extension, of.address))

    def _received_poll(self, now: float, data: bytes) -> None:
        assert self._requested is not None
        (_, of), self._requested = self._requested, None
        if data[0] == packets.ERROR:
            self._trouble = f"XCP: {of.name} at {now:.4f} s: {packets.ERRORS.get(data[1], 'error')}"
            return
        self.samples[of.name].add(now, data[1 : 1 + of.size])
        following = self._polled.index(of) + 1 if of in self._polled else len(self._polled)
        if following < len(self._polled):
            self._ask(self._polled[following])

    def daq(self, names: Sequence[str], event: int) -> None:
        """Have the ECU send measurements at an event channel, by a dynamic DAQ list.

        The time of a value is that of its frame. Raises InputError where the ECU cannot.
        """
        info = self.request(packets.GET_DAQ_PROCESSOR_INFO, "GET_DAQ_PROCESSOR_INFO")
        if not info[1] & packets.DYNAMIC or info[7] >> 6:
            raise InputError(
                "the ECU has no DAQ lists of the kind that is used here",
                expected="dynamic DAQ lists, absolute ODT numbers",
                found=f"DAQ_PROPERTIES {info[1]:#04x}, DAQ_KEY_BYTE {info[7]:#04x}",
                remedy="poll the measurements: xcp.poll",
            )
        tables = _tables([self.measurement(name) for name in names])
        for packet, what in self._allocation(tables, event):
            self.request(packet, what)
        first = self.request(packets.select_daq_list(self._order, 0), "START_STOP_DAQ_LIST")[1]
        self.samples |= {of.name: Samples(of) for table in tables for of in table}
        self._daq = dict(enumerate(tables, first))
        self.request(packets.START_SELECTED, "START_STOP_SYNCH")

    def _allocation(
        self, tables: list[list[XcpMeasurement]], event: int
    ) -> list[tuple[bytes, str]]:
        """Commands that set up one DAQ list, with their names."""
        order = self._order
        commands = [(packets.FREE_DAQ, "FREE_DAQ"), (packets.alloc_daq(order, 1), "ALLOC_DAQ")]
        commands.append((packets.alloc_odt(order, 0, len(tables)), "ALLOC_ODT"))
        for odt, table in enumerate(tables):
            entries = packets.alloc_odt_entry(order, 0, odt, len(table))
            commands.append((entries, "ALLOC_ODT_ENTRY"))
        for odt, table in enumerate(tables):
            commands.append((packets.set_daq_ptr(order, 0, odt, 0), "SET_DAQ_PTR"))
            for of in table:
                entry = packets.write_daq(order, of.size, of.extension, of.address)
                commands.append((entry, f"WRITE_DAQ of {of.name}"))
        mode = packets.set_daq_list_mode(order, 0, event)
        return [*commands, (mode, f"SET_DAQ_LIST_MODE of event channel {event}")]

    def _received_daq(self, now: float, data: bytes) -> None:
        place = 1
        for of in self._daq[data[0]]:
            self.samples[of.name].add(now, data[place : place + of.size])
            place += of.size

    def problems(self) -> list[str]:
        """Why measurements ended, or never began; empty where all is well."""
        silent = [
            name
            for name, samples in self.samples.items()
            if not samples.times and (self._daq or self._polled)
        ]
        never = f"XCP: no sample of {', '.join(silent)}" if silent else ""
        return [text for text in (self._trouble, never) if text]


def _tables(measurements: Sequence[XcpMeasurement]) -> list[list[XcpMeasurement]]:
    """Measurements in groups that fit into one packet each, in their order."""
    tables: list[list[XcpMeasurement]] = [[]]
    for of in measurements:
        if sum(each.size for each in tables[-1]) + of.size > ROOM:
            tables.append([])
        tables[-1].append(of)
    return tables


class XcpOnBus:
    """XCP on the bus of a test: `connect` gives a session with an ECU."""

    def __init__(self, bus: BenchBus) -> None:
        """Send on a node of its own."""
        self._bus, self._node = bus, bus.node("xcp")
        self.sessions: list[XcpSession] = []

    def connect(
        self, file: str | Path, command: int | None = None, response: int | None = None
    ) -> XcpSession:
        """Session with the ECU of an A2L file. command, response: identifiers, else of the file.

        Raises InputError where the file is not valid or the ECU does not answer.
        """
        read = read_a2l(Path(file))
        used = A2l(
            read.origin,
            read.measurements,
            read.command if command is None else command,
            read.response if response is None else response,
        )
        session = XcpSession(self._bus, used, self._node)
        session.connect()
        self.sessions.append(session)
        return session

    def table(self) -> str:
        """All samples as CSV text: time in s, one column with its unit for each measurement.

        A row has the samples of one time; other cells are empty. Empty without samples.
        """
        columns = [each for session in self.sessions for each in session.samples.values()]
        rows: dict[float, dict[int, float]] = {}
        for place, column in enumerate(columns):
            for time, value in zip(column.times, column.values, strict=True):
                rows.setdefault(time, {})[place] = value
        if not rows:
            return ""
        head = ["time [s]", *(_title(column.of) for column in columns)]
        lines = [",".join(head)]
        for time in sorted(rows):
            cells = (f"{rows[time][n]:.9g}" if n in rows[time] else "" for n in range(len(columns)))
            lines.append(",".join([f"{time:.6f}", *cells]))
        return "\n".join(lines) + "\n"

    def problems(self) -> list[str]:
        """Why measurements ended or never began, of all sessions."""
        return [text for session in self.sessions for text in session.problems()]


def _title(of: XcpMeasurement) -> str:
    return f"{of.name} [{of.unit}]" if of.unit else of.name

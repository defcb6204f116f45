"""Frames from messages and messages from frames: SI inside, the units of the database on the wire."""

from collections.abc import Mapping

from slipbench.protocol.codec import e2e
from slipbench.protocol.codec.faults import Fault, FrameFault
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    BenchMessage,
    ChassisStatus,
    EcuStatus,
    EncoderStatus,
    EngineStatus,
    Intervals,
    OpticalSpeed,
    RiderControls,
    Temperatures,
    ThrottleStatus,
    ToothIntervals,
    TrialStatus,
)
from slipbench.protocol.codec.wire import FieldsPlan, Plan, TeethPlan
from slipbench.protocol.database.layout import Database
from slipbench.protocol.errors import InputError

MESSAGES: dict[str, type[BenchMessage]] = {
    **{
        message.__name__: message
        for message in (
            ActuatorCommand,
            EcuStatus,
            ThrottleStatus,
            EngineStatus,
            OpticalSpeed,
            RiderControls,
            ChassisStatus,
            Temperatures,
            TrialStatus,
        )
    },
    "RearTeeth": ToothIntervals,
    "FrontTeeth": ToothIntervals,
    "RearEncoderStatus": EncoderStatus,
    "FrontEncoderStatus": EncoderStatus,
}


class Codec:
    """Encodes and decodes the bench's messages as one database lays them out.

    A message is named by its class; tooth intervals and encoder statuses, which both encoders
    send, by their name in the database: "RearTeeth", "FrontEncoderStatus".
    """

    def __init__(self, database: Database) -> None:
        """Compile the database. Raises InputError where it lacks a message or signal of the bench."""
        self._by_name: dict[str, Plan] = {
            name: (TeethPlan if kind is ToothIntervals else FieldsPlan)(database, name, kind)
            for name, kind in MESSAGES.items()
        }
        self._by_identifier = {plan.identifier: plan for plan in self._by_name.values()}

    def encode(
        self, message: BenchMessage, *, counter: int = 0, name: str | None = None
    ) -> tuple[int, bytes]:
        """Identifier and payload of a message, with its end-to-end protection.

        counter: of its end-to-end protection, see `Sender`. Clocks and running counts wrap at
        their signals' widths. Raises ValueError for any other value that its signal cannot hold.
        """
        plan = self._plan(name or type(message).__name__)
        payload = bytearray(plan.pack(message).to_bytes(plan.length, "little"))
        if plan.data_id is not None:
            e2e.protect(payload, plan.data_id, counter)
        return plan.identifier, bytes(payload)

    def decode(self, identifier: int, data: bytes | bytearray) -> BenchMessage | FrameFault:
        """Message of a frame, or its fault; the CRC is checked, bytes beyond the message are ignored."""
        plan = self._by_identifier.get(identifier)
        if plan is None:
            return FrameFault(Fault.UNKNOWN, expected="one of the bench's", found=hex(identifier))
        length = plan.length
        if len(data) < length:
            return plan.fault(Fault.SHORT, f"{length} bytes", f"{len(data)} bytes")
        payload = bytearray(data[:length])
        if plan.data_id is not None and not e2e.crc_is_right(payload, plan.data_id):
            return plan.fault(Fault.CRC, "the CRC of its content", f"{payload[0]:#04x}")
        return plan.unpack(int.from_bytes(payload, "little"))

    def counter(self, identifier: int, data: bytes | bytearray) -> int | None:
        """Counter of a frame; None where the message is not protected."""
        plan = self._by_identifier.get(identifier)
        if plan is None or plan.data_id is None or len(data) < 2:
            return None
        return data[1] & 0x0F

    def identifier(self, name: str) -> int:
        """Identifier of a message."""
        return self._plan(name).identifier

    def name(self, identifier: int) -> str | None:
        """Name of the message with this identifier; None where it is unknown."""
        plan = self._by_identifier.get(identifier)
        return plan.name if plan else None

    def period(self, name: str, field: str) -> float:
        """Value at which a clock (s) or a running count wraps."""
        return self._plan(name).period(field)

    def capacity(self, name: str) -> Mapping[Intervals, tuple[int, float]]:
        """Number of intervals in a tooth frame of each layout, and the longest interval (s)."""
        plan = self._plan(name)
        return plan.capacity() if isinstance(plan, TeethPlan) else {}

    def _plan(self, name: str) -> Plan:
        try:
            return self._by_name[name]
        except KeyError:
            known = ", ".join(self._by_name)
            raise InputError(f"no message {name!r}", expected=known) from None


class Sender:
    """Sending side of a node: the next counter of each protected message."""

    def __init__(self, codec: Codec) -> None:
        self._codec = codec
        self.counters: dict[str, int] = {}

    def encode(self, message: BenchMessage, *, name: str | None = None) -> tuple[int, bytes]:
        """Identifier and payload of `message` with its next counter. Raises ValueError as `Codec.encode` does."""
        key = name or type(message).__name__
        counter = self.counters.get(key, 0)
        frame = self._codec.encode(message, counter=counter, name=key)
        self.counters[key] = (counter + 1) % e2e.PERIOD
        return frame

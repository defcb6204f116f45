"""Real devices on the bus of the virtual motorcycle: their last messages, and whether they send as agreed.

A frame counts when its CRC is right and its counter has advanced (E2E). A device that has sent once must
go on: silence, and a rate of less than half of what is agreed, end the simulation. So does a frame of
another sender in the name of a node that is simulated.
"""

from dataclasses import dataclass, field

from slipbench.bench.vehicle.nodes import ALL_NODES, MESSAGES_OF, NODE_OF
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.faults import Fault, FrameFault
from slipbench.protocol.codec.messages import ActuatorCommand, BenchMessage, EcuStatus
from slipbench.protocol.errors import InputError

SILENT = 0.1  # s without a valid frame after which a device counts as silent
WINDOW = 0.5  # s over which frames are counted
LEAST = 0.5  # of the frames that are due in a window; a healthy device's jitter stays far above
# The messages that the bench needs from each node; a real ECU may lack the others.
NEEDED = {
    "ecu": ("EcuStatus", "EngineStatus"),
    "throttle": ("ThrottleStatus",),
    "rear_encoder": ("RearTeeth", "RearWheelSpeed"),
    "front_encoder": ("FrontTeeth", "FrontWheelSpeed"),
    "optical": ("OpticalSpeed",),
    "rider": ("RiderControls",),
}


@dataclass
class _Reception:
    """Frames of one message of a real device. period: s, agreed; None where it sends on events."""

    period: float | None
    counter: int | None = None  # of the last frame
    last: float | None = None  # s, when the last valid frame arrived
    window: float = 0.0  # s, begin of the window
    count: int = 0  # valid frames in the window
    invalid: dict[str, int] = field(default_factory=dict)  # faults since the last valid frame


class RealDevices:
    """Messages of the nodes that are not simulated."""

    def __init__(self, simulated: frozenset[str], codec: Codec) -> None:
        """Listen to every node outside of `simulated` that the database has."""
        self._nodes = frozenset(
            node for node in ALL_NODES - simulated if any(map(codec.has, MESSAGES_OF[node]))
        )
        self._needed = {node: tuple(filter(codec.has, NEEDED[node])) for node in self._nodes}
        self._receptions = {
            name: _Reception(_period(codec, name))
            for node in self._nodes
            for name in MESSAGES_OF[node]
            if codec.has(name)
        }
        self._ecu: EcuStatus | None = None

    @property
    def waited_for(self) -> tuple[str, ...]:
        """Nodes of which a needed message has never arrived, in the order of the bus."""
        return tuple(
            node
            for node in MESSAGES_OF
            if node in self._nodes
            and any(self._receptions[name].last is None for name in self._needed[node])
        )

    def command(self, now: float, silence: float) -> ActuatorCommand | None:
        """Command of the real ECU at `now` (s); None before its first frame and after `silence` s."""
        status = self._ecu
        last = self._receptions["EcuStatus"].last if status else None
        if status is None or last is None or now - last > silence:
            return None
        return ActuatorCommand(status.authority, status.throttle_command, status.spark_command, now)

    def receive(
        self, name: str, message: BenchMessage | FrameFault | None, counter: int | None, now: float
    ) -> bool:
        """Whether a frame of message `name`, which arrived at `now` (s), is valid.

        message: None while a message of several frames is not whole.

        Raises InputError where the node that should send it is simulated.
        """
        if name not in self._receptions:
            raise _second_sender(name)
        reception = self._receptions[name]
        fault = message if isinstance(message, FrameFault) else _repetition(reception, counter)
        if fault is not None:
            reception.invalid[fault.fault] = reception.invalid.get(fault.fault, 0) + 1
            return False
        if reception.last is None:
            reception.window = now
        reception.last, reception.count = now, reception.count + 1
        reception.invalid.clear()
        if isinstance(message, EcuStatus):
            self._ecu = message
        return True

    def check(self, now: float) -> None:
        """Raises InputError where a device that has sent is silent or late at `now` (s)."""
        for node in self._nodes:
            for name in self._needed[node]:
                reception = self._receptions[name]
                if reception.last is None:
                    continue
                if now - reception.last > SILENT:
                    raise _silent(node, name, reception, now)
                if now - reception.window >= WINDOW:
                    if reception.period and reception.count < LEAST * WINDOW / reception.period:
                        raise _late(node, name, reception, now)
                    reception.window, reception.count = now, 0


def _period(codec: Codec, name: str) -> float | None:
    """Longest cycle time (s) of the frames of a message; None where they come on events."""
    messages = [codec.plan_of(carrier).message for carrier in codec.carriers(name)]
    if any(message.attributes.get("GenMsgSendType", 0) for message in messages):
        return None
    return max((message.cycle_time or 0.0 for message in messages), default=0.0) or None


def _second_sender(name: str) -> InputError:
    node = NODE_OF[name]
    return InputError(
        "another device on the bus sends for a node that is simulated here",
        where=node,
        expected=f"{name} from this simulation alone",
        found=f"{name} from another sender",
        remedy=f"leave the node to the real device (--without {node}), or take the device or "
        "the second simulation off the bus",
    )


def _repetition(reception: _Reception, counter: int | None) -> FrameFault | None:
    """The fault of a frame whose counter did not advance; lost frames are none."""
    if counter is None:
        return None
    last, reception.counter = reception.counter, counter
    return FrameFault(Fault.REPEATED) if counter == last else None


def _agreed(period: float | None) -> str:
    return f"every {period * 1e3:g} ms" if period else "as the wheel turns"


def _silent(node: str, name: str, reception: _Reception, now: float) -> InputError:
    assert reception.last is not None
    faults = ", ".join(f"{number} with {fault}" for fault, number in reception.invalid.items())
    return InputError(
        "the real device has fallen silent",
        where=node,
        expected=f"{name} {_agreed(reception.period)}",
        found=f"no valid frame for {(now - reception.last) * 1e3:.0f} ms"
        + (f"; invalid frames: {faults}" if faults else ""),
        remedy="check its supply, its wiring and its program; then start the simulation again",
    )


def _late(node: str, name: str, reception: _Reception, now: float) -> InputError:
    every = (now - reception.window) / max(reception.count, 1)
    return InputError(
        "the real device sends too rarely",
        where=node,
        expected=f"{name} {_agreed(reception.period)}",
        found=f"every {every * 1e3:.1f} ms, on average over {now - reception.window:.1f} s",
        remedy="correct its cycle time or its load; then start the simulation again",
    )

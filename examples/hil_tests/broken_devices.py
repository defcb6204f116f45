"""Three devices with a planted fault, to show that the suite finds it.

Each is the virtual motorcycle behind a faulty CAN driver: what it receives or sends is changed.

    pytest examples/hil_tests --slipbench-device broken_devices:watchdog_off
"""

from collections import deque

import can

from slipbench.bench.vehicle.virtual_motorcycle import Scenario, VirtualMotorcycle
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import ActuatorCommand, Authority, EcuStatus

WATCHDOG = 20  # cycles of 1 ms
COUNTERS = 15  # values of the counter


class Driver(can.BusABC):
    """Passes every frame between a device and its bus; a faulty driver changes some of them."""

    def __init__(self, bus: can.BusABC, codec: Codec) -> None:
        """Stand between a device and `bus`."""
        self.bus, self.codec = bus, codec
        self.waiting: deque[can.Message] = deque()
        self.channel_info = bus.channel_info
        super().__init__(channel="device")
        self.shutdown()  # it owns no channel: the plugin closes the bus

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame of the device."""
        self.bus.send(msg, timeout)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self.waiting:
            message = self.bus.recv(0)
            self.waiting.extend(self.end_of_cycle() if message is None else self.received(message))
        return (self.waiting.popleft() if self.waiting else None), False

    def received(self, message: can.Message) -> list[can.Message]:
        """Frames that the device gets instead of `message`."""
        return [message]

    def end_of_cycle(self) -> list[can.Message]:
        """Frames that the device gets after the last one of a cycle."""
        return []

    def frame(self, command: ActuatorCommand, counter: int) -> can.Message:
        """Frame of a command."""
        identifier, data = self.codec.encode(command, counter=counter % COUNTERS)
        return can.Message(arbitration_id=identifier, data=data, is_extended_id=False)


class CommandDriver(Driver):
    """Keeps the last valid command and the cycles since then."""

    def __init__(self, bus: can.BusABC, codec: Codec) -> None:
        """Start without a command."""
        super().__init__(bus, codec)
        self.command = ActuatorCommand(Authority.NONE, 0.0, 0.0, 0.0)
        self.counter, self.cycles = 0, 0

    def valid(self, message: can.Message) -> bool:
        """Whether `message` is a valid command; it is kept then."""
        command = self.codec.decode(message.arbitration_id, message.data)
        counter = self.codec.counter(message.arbitration_id, message.data)
        if not isinstance(command, ActuatorCommand) or counter is None or counter == self.counter:
            return False
        self.command, self.counter, self.cycles = command, counter, 0
        return True


class KeepAlive(CommandDriver):
    """The device never notices silence: the last command comes again in every cycle."""

    repeated = 0

    def received(self, message: can.Message) -> list[can.Message]:
        """The frame itself."""
        self.valid(message)
        return [message]

    def end_of_cycle(self) -> list[can.Message]:
        """The last command with another counter, once in a cycle."""
        self.cycles += 1
        if self.command.authority == Authority.NONE or self.cycles % 2 == 0:
            return []
        self.repeated += 1
        return [self.frame(self.command, self.counter + 5 + self.repeated % 2)]


class ForgottenLatch(CommandDriver):
    """After a watchdog timeout the device believes that a release has come."""

    def received(self, message: can.Message) -> list[can.Message]:
        """The frame itself, and a release before the first valid command after a timeout."""
        silent = self.cycles > WATCHDOG
        if not self.valid(message) or not silent:
            return [message]
        release = ActuatorCommand(Authority.NONE, 0.0, 0.0, 0.0)
        return [self.frame(release, self.counter + 7), message]

    def end_of_cycle(self) -> list[can.Message]:
        """No frame; a cycle has passed."""
        self.cycles += 1
        return []


class StuckCounter(Driver):
    """The counter of EcuStatus stands still; its CRC is correct."""

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame, an EcuStatus with counter 3."""
        status = self.codec.decode(msg.arbitration_id, msg.data)
        if isinstance(status, EcuStatus):
            msg.data = bytearray(self.codec.encode(status, counter=3)[1])
        super().send(msg, timeout)


def watchdog_off(scenario: Scenario, bus: can.BusABC, codec: Codec) -> VirtualMotorcycle:
    """Device whose watchdog is off: it keeps authority when the commands stop."""
    return VirtualMotorcycle(scenario, KeepAlive(bus, codec), codec)


def counter_stuck(scenario: Scenario, bus: can.BusABC, codec: Codec) -> VirtualMotorcycle:
    """Device whose status counter stands still."""
    return VirtualMotorcycle(scenario, StuckCounter(bus, codec), codec)


def grant_without_release(scenario: Scenario, bus: can.BusABC, codec: Codec) -> VirtualMotorcycle:
    """Device that grants again after a watchdog timeout although nobody released authority."""
    return VirtualMotorcycle(scenario, ForgottenLatch(bus, codec), codec)

"""A virtual motorcycle on a simulated bus, which speaks the messages of a binding."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import can

from slipbench import dbc
from slipbench.bench.bus.simulated_bus import SimulatedBus
from slipbench.bench.check.traffic import BusTraffic, frame_log
from slipbench.bench.loop.clock import MILLISECOND, SECOND, SimulatedClock
from slipbench.bench.vehicle.virtual_motorcycle import Scenario, VirtualMotorcycle, read_vehicle
from slipbench.protocol.binding.binding import Binding, bind, read_binding
from slipbench.protocol.binding.fields import FIELDS
from slipbench.protocol.recording.message_rules import Degraded
from tests.bench.conditions import trial_file
from tests.paths import DEMONSTRATION


def own(without: tuple[str, ...] = (), **degraded: object) -> Binding:
    """Binding to the bench's own database, without some roles."""
    binding = read_binding(Path(dbc.MOTORBIKE_ROLES))
    assert binding.roles is not None
    roles = {role: source for role, source in binding.roles.roles.items() if role not in without}
    file = binding.roles.model_copy(
        update={"roles": roles, "degraded": Degraded.model_validate(degraded)}
    )
    return bind(file, binding.database, Path(dbc.MOTORBIKE_ROLES))


@dataclass
class World:
    """What runs while the clock of the test waits.

    bus, ours  the first bus, and the node of the bench on it; all_ours: on each
    """

    binding: Binding
    silence: str = "20 ms"
    ticks: int = 0

    def __post_init__(self) -> None:
        """Put the motorcycle on the buses of the binding."""
        trial = trial_file(command__silence=self.silence)
        self.buses = [SimulatedBus(1_000_000) for _ in self.binding.buses]
        self.all_ours = [bus.node("bench", receive_own_messages=True) for bus in self.buses]
        self.theirs = [bus.node("motorcycle") for bus in self.buses]
        self.bus, self.ours = self.buses[0], self.all_ours[0]
        scenario = Scenario(read_vehicle(DEMONSTRATION), trial)
        self.motorcycle = VirtualMotorcycle(scenario, self.theirs, self.binding.codec())
        self.clock = SimulatedClock(SECOND, self.advance)

    def advance(self, until: int) -> None:
        """Let the motorcycle run until a time, ns."""
        while SECOND + (self.ticks + 1) * MILLISECOND <= until:
            due = SECOND + (self.ticks + 1) * MILLISECOND
            for bus in self.buses:
                bus.advance_to(due - MILLISECOND // 2)
            self.motorcycle.tick(self.ticks, due - MILLISECOND // 2)
            for bus in self.buses:
                bus.advance_to(due)
            self.ticks += 1

    def frames(self, seconds: float) -> list[can.Message]:
        """Frames that the motorcycle sends within some time."""
        found = []
        for _ in range(round(seconds * 1000)):
            self.clock.sleep_until_ns(self.clock.now_ns() + MILLISECOND)
            while (frame := self.ours.recv(0)) is not None:
                found.append(frame)
        return found

    def close(self) -> None:
        """Leave the bus."""
        for node in (*self.all_ours, *self.theirs):
            node.shutdown()


@contextmanager
def world(binding: Binding, silence: str = "20 ms") -> Iterator[World]:
    """A motorcycle that speaks as the binding says. silence: its command watchdog."""
    made = World(binding, silence)
    try:
        yield made
    finally:
        made.close()


def traffic(binding: Binding, frames: list[can.Message]) -> BusTraffic:
    """Frames as the check sees them."""
    return BusTraffic(frame_log(("bus", each) for each in frames), binding.database)


def with_rules(binding: Binding, **rules: object) -> Binding:
    """The binding with other rules of messages."""
    assert binding.roles is not None
    file = type(binding.roles).model_validate(
        {**binding.roles.model_dump(), "messages": {**binding.roles.messages, **rules}}
    )
    assert binding.path is not None
    return bind(file, binding.database, binding.path)


def changed(message: can.Message, **values: object) -> can.Message:
    """A frame with other attributes."""
    made = can.Message(
        arbitration_id=message.arbitration_id,
        data=message.data,
        is_extended_id=message.is_extended_id,
        timestamp=message.timestamp,
    )
    for name, value in values.items():
        setattr(made, name, value)
    return made


__all__ = ["FIELDS", "World", "changed", "own", "replace", "traffic", "with_rules", "world"]

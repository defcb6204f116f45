"""Device under test: the virtual motorcycle, a device given by name, or a real one on the bus."""

from collections.abc import Callable
from importlib import import_module
from typing import Protocol

import can

from slipbench.bench.loop.clock import MILLISECOND
from slipbench.bench.testing.bench_bus import BenchBus
from slipbench.bench.vehicle.virtual_motorcycle import Scenario, VirtualMotorcycle
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.errors import InputError

PHASE = 350_000  # ns after the gateway's tick, as in a simulated trial
VIRTUAL, EXTERNAL = "virtual", "external"
NODE = "motorcycle"  # its name in fault plans, as in those of a trial


class Device(Protocol):
    """Something on the bus that is run every millisecond."""

    def tick(self, number: int, due: int) -> bool:
        """Run millisecond `number` (from 0), due at `due` (ns). False when it has ended."""


# Makes a device, as `VirtualMotorcycle` does: from a scenario, its bus and the messages.
DeviceFactory = Callable[[Scenario, can.BusABC, Codec], Device]


class ExternalDevice:
    """A device that is on the bus already; this process does not run it."""

    def tick(self, number: int, due: int) -> bool:
        """Nothing to run."""
        return False


def device_factory(name: str) -> DeviceFactory:
    """Factory of the option: "virtual", or "module:name". Raises InputError where there is none."""
    if name == VIRTUAL:
        return VirtualMotorcycle
    module, colon, attribute = name.partition(":")
    expected = f"{VIRTUAL}, {EXTERNAL}, or module:name of a function (scenario, bus, codec)"
    if not colon:
        raise InputError("the device under test is not known", expected=expected, found=name)
    try:
        factory = getattr(import_module(module), attribute)
    except (ImportError, AttributeError) as cause:
        raise InputError(
            "the device under test cannot be imported",
            expected=expected,
            found=f"{name}: {cause}",
            remedy="check the name, and that its folder is in the import path (pythonpath in ini)",
        ) from cause
    if not callable(factory):
        raise InputError("the device under test cannot be made", expected=expected, found=name)
    made: DeviceFactory = factory
    return made


def join(bus: BenchBus, name: str, scenario: Callable[[], Scenario]) -> Device:
    """Device under test on the bus, run every millisecond. Raises InputError where it cannot be.

    name: of `device_factory`, or "external". scenario: called where a device is made.
    """
    if name == EXTERNAL:
        if not bus.real_time:
            raise InputError(
                "an external device needs real time",
                expected="--slipbench-clock real-time and the interface of the device",
                found="the simulated clock, on which only simulated devices live",
            )
        return ExternalDevice()
    factory = device_factory(name)
    device = factory(scenario(), bus.node(NODE), Codec(bus.database))
    bus.schedule(MILLISECOND, device.tick, PHASE)
    return device

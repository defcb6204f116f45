"""Where a trial runs: simulated clock, virtual motorcycle in real time, or a real bus."""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from slipbench.bench.bus.channels import addresses_of
from slipbench.bench.bus.opening import BusAddress
from slipbench.bench.trials.preparation import Prepared
from slipbench.bench.vehicle.live_vehicle import VehicleProcess, vehicle_process


@dataclass(frozen=True)
class Connection:
    """Where trials run.

    interface  of python-can; None: the motorcycle is simulated
    channels   of the interface, as `addresses_of` takes them
    bitrate    bit/s
    fd         the bus is opened for CAN FD
    real_time  without an interface: virtual motorcycle in a process of its own, in real time
    """

    interface: str | None = None
    channels: Sequence[str] = ()
    bitrate: int = 1_000_000
    fd: bool = False
    real_time: bool = False

    @property
    def simulated(self) -> bool:
        """Whether trials run on the simulated clock."""
        return self.interface is None and not self.real_time


Ends = tuple[Sequence[BusAddress] | None, VehicleProcess | None]


@contextmanager
def connected(prepared: Prepared, to: Connection) -> Iterator[Ends]:
    """Addresses of the buses, None on the simulated clock; and the virtual motorcycle's process.

    Raises InputError where a bus of the binding has no channel.
    """
    if to.interface is not None:
        yield (addresses_of(to.channels, prepared.binding, to.interface, to.bitrate, to.fd), None)
    elif to.real_time:
        addresses = [
            BusAddress(
                "slipbench", f"trial-{os.getpid()}{bus and '-'}{bus}", to.bitrate, to.fd, bus
            )
            for bus in prepared.binding.buses
        ]
        with vehicle_process(prepared.scenario, prepared.binding, addresses) as process:
            yield addresses, process
    else:
        yield None, None

"""The virtual motorcycle in real time: a program of its own, or a process beside a trial."""

import copyreg
import multiprocessing
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from types import MappingProxyType
from typing import Any

from slipbench.bench.bus.opening import BusAddress, open_bus, told_when_gone
from slipbench.bench.loop.clock import MILLISECOND, MonotonicClock
from slipbench.bench.loop.exit_status import ended
from slipbench.bench.loop.interrupts import ignore_interrupts, interrupts, start
from slipbench.bench.loop.loop import run_ticks
from slipbench.bench.loop.process_watch import process_pipe
from slipbench.bench.loop.realtime_process import die_with, undisturbed
from slipbench.bench.vehicle.virtual_motorcycle import Ride, VirtualMotorcycle
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.database.layout import Database
from slipbench.protocol.errors import InputError

LEAVING = 10.0  # s that a vehicle has to leave the bus
SPIN = 20_000  # ns: a motorcycle may be late by that much; the processor is the bench's


def _view(of: dict[str, Any]) -> MappingProxyType[str, Any]:
    return MappingProxyType(of)


# A vehicle's tables are read-only views, which pickle does not know; they travel as what they view.
copyreg.pickle(MappingProxyType, lambda view: (_view, (dict(view),)))


def ride_until(
    over: Callable[[], bool],
    ride: Ride,
    database: Database,
    address: BusAddress,
    calm: Callable[[], AbstractContextManager[object]] = nullcontext,
    ready: Callable[[], None] = lambda: None,
) -> VirtualMotorcycle:
    """Ride on the bus until `over` says so, in `calm`; returns the motorcycle as it then is.

    `ready` is called once the bus is open and the motorcycle about to ride.

    Raises InputError where the bus cannot be opened, or is gone meanwhile.
    """
    with open_bus(address, hears_itself=False) as bus, told_when_gone(address):
        motorcycle = VirtualMotorcycle(ride, bus, Codec(database))

        def tick(number: int, due: int) -> bool:
            return motorcycle.tick(number, due) and not over()

        ready()
        with calm():
            run_ticks(tick, MILLISECOND, MonotonicClock(SPIN))
        return motorcycle


@dataclass(frozen=True)
class VehicleProcess:
    """A process in which the virtual motorcycle rides. pipe: closed by the kernel when it ends."""

    process: BaseProcess
    pipe: Connection

    def why_ended(self) -> str:
        """How the process died, in words; empty where it lives or ended as it was asked to."""
        return ended(self.process)


@contextmanager
def riding_beside(ride: Ride, database: Database, address: BusAddress) -> Iterator[VehicleProcess]:
    """Ride in a process of its own for as long as the block lasts, on a bus that it shares."""
    watching, watched = process_pipe()
    process = multiprocessing.get_context("spawn").Process(
        target=_ride_on, args=(ride, database, address, watched), name="slipbench vehicle"
    )
    try:
        start(process)
        watched.close()
        yield VehicleProcess(process, watching)
    finally:
        watching.close()
        if process.pid is not None:
            process.terminate()
            process.join(LEAVING)
        if process.is_alive():  # stopped, or hanging: it holds nothing that would be lost
            process.kill()
            process.join()


def _ride_on(ride: Ride, database: Database, address: BusAddress, _pipe: Connection) -> None:
    """Ride until asked to end; what the terminal says is the trial's, which hands back to it."""
    die_with(signal.SIGTERM)
    over = threading.Event()
    with interrupts(over):
        ignore_interrupts()
        try:
            ride_until(over.is_set, ride, database, address, undisturbed)
        except InputError as fault:
            raise SystemExit(f"slipbench vehicle: {fault}") from fault

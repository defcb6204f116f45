"""The virtual motorcycle in real time: a program of its own, or a process beside a trial."""

import copyreg
import multiprocessing
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from types import MappingProxyType
from typing import Any

from slipbench.bench.bus.opening import BusAddress, open_bus, told_when_gone
from slipbench.bench.loop.clock import MILLISECOND, MonotonicClock
from slipbench.bench.loop.interrupts import asking, interrupts
from slipbench.bench.loop.loop import run_periodic
from slipbench.bench.loop.realtime_process import die_with, undisturbed
from slipbench.bench.vehicle.virtual_motorcycle import Ride, VirtualMotorcycle
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.database.layout import Database
from slipbench.protocol.errors import InputError

A_DAY_AT_THE_TRACK = 8 * 3_600_000  # ms
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
) -> VirtualMotorcycle:
    """Ride on the bus until `over` says so, in `calm`; returns the motorcycle as it then is.

    Raises InputError where the bus cannot be opened, or is gone meanwhile.
    """
    with open_bus(address, hears_itself=False) as bus, told_when_gone(address):
        motorcycle = VirtualMotorcycle(ride, bus, Codec(database))

        def tick(number: int, due: int) -> bool:
            return motorcycle.tick(number, due) and not over()

        with calm():
            run_periodic(tick, MILLISECOND, MonotonicClock(SPIN), most=A_DAY_AT_THE_TRACK)
        return motorcycle


@contextmanager
def riding_beside(ride: Ride, database: Database, address: BusAddress) -> Iterator[None]:
    """Ride in a process of its own for as long as the block lasts, on a bus that it shares."""
    process = multiprocessing.get_context("spawn").Process(
        target=_ride_on, args=(ride, database, address), name="slipbench vehicle"
    )
    process.start()
    try:
        yield
    finally:
        process.terminate()
        process.join(LEAVING)
        if process.is_alive():  # stopped, or hanging: it holds nothing that would be lost
            process.kill()
            process.join()


def _ride_on(ride: Ride, database: Database, address: BusAddress) -> None:
    """Ride until asked to end; what the terminal says is the trial's, which hands back to it."""
    die_with(signal.SIGTERM)
    over = threading.Event()
    with interrupts(over):
        for number in set(asking()) - {signal.SIGTERM}:
            signal.signal(number, signal.SIG_IGN)
        try:
            ride_until(over.is_set, ride, database, address, undisturbed)
        except InputError as fault:
            raise SystemExit(f"slipbench vehicle: {fault}") from fault

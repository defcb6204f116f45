"""The virtual motorcycle in real time: as a process of its own, or beside a trial in a thread."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from bench.buses import BusAddress, open_bus
from bench.clock import MILLISECOND, MonotonicClock
from bench.loop import run_periodic
from bench.virtual_motorcycle import Ride, VirtualMotorcycle
from protocol.codec import Codec
from protocol.layout import Database

A_DAY_AT_THE_TRACK = 8 * 3_600_000  # ms


def ride_until(
    over: Callable[[], bool], ride: Ride, database: Database, address: BusAddress
) -> VirtualMotorcycle:
    """Ride on the bus until `over` says so; returns the motorcycle as it then is."""
    with open_bus(address, hears_itself=False) as bus:
        motorcycle = VirtualMotorcycle(ride, bus, Codec(database))

        def tick(number: int, due: int) -> bool:
            return motorcycle.tick(number, due) and not over()

        run_periodic(tick, MILLISECOND, MonotonicClock(), most=A_DAY_AT_THE_TRACK)
        return motorcycle


@contextmanager
def riding(ride: Ride, database: Database, address: BusAddress) -> Iterator[None]:
    """Ride in a thread for as long as the block lasts."""
    over = threading.Event()
    thread = threading.Thread(
        target=ride_until, args=(over.is_set, ride, database, address), daemon=True
    )
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()

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

from slipbench.bench.bus.opening import BusAddress, bus_failure_as_input_error, open_bus
from slipbench.bench.loop.clock import MILLISECOND, MonotonicClock
from slipbench.bench.loop.exit_status import exit_reason
from slipbench.bench.loop.interrupts import ignore_interrupts, interrupts, start
from slipbench.bench.loop.loop import run_ticks
from slipbench.bench.loop.process_watch import process_pipe
from slipbench.bench.loop.realtime_process import realtime_process, signal_on_parent_exit
from slipbench.bench.vehicle.virtual_motorcycle import Scenario, VirtualMotorcycle
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.database.layout import Database
from slipbench.protocol.errors import InputError

LEAVING = 10.0  # s that a vehicle has to leave the bus
SPIN = 20_000  # ns: a motorcycle may be late by that much; the processor is the bench's


def _view(of: dict[str, Any]) -> MappingProxyType[str, Any]:
    return MappingProxyType(of)


# A vehicle's tables are read-only views, which pickle does not know; they travel as what they view.
copyreg.pickle(MappingProxyType, lambda view: (_view, (dict(view),)))


def simulate_until(
    over: Callable[[], bool],
    scenario: Scenario,
    database: Database,
    address: BusAddress,
    calm: Callable[[], AbstractContextManager[object]] = nullcontext,
    ready: Callable[[], None] = lambda: None,
) -> VirtualMotorcycle:
    """Scenario on the bus until `over` says so, in `calm`; returns the motorcycle as it then is.

    `ready` is called once the bus is open and the motorcycle about to scenario.

    Raises InputError where the bus cannot be opened, or is gone meanwhile.
    """
    with open_bus(address, receive_own_messages=False) as bus, bus_failure_as_input_error(address):
        motorcycle = VirtualMotorcycle(scenario, bus, Codec(database))

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
        return exit_reason(self.process)


@contextmanager
def vehicle_process(
    scenario: Scenario, database: Database, address: BusAddress
) -> Iterator[VehicleProcess]:
    """Scenario in a process of its own for as long as the block lasts, on a bus that it shares."""
    watching, watched = process_pipe()
    process = multiprocessing.get_context("spawn").Process(
        target=_ride_on, args=(scenario, database, address, watched), name="slipbench vehicle"
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


def _ride_on(
    scenario: Scenario, database: Database, address: BusAddress, _pipe: Connection
) -> None:
    """Scenario until asked to end; what the terminal says is the trial's, which hands back to it."""
    signal_on_parent_exit(signal.SIGTERM)
    over = threading.Event()
    with interrupts(over):
        ignore_interrupts()
        try:
            simulate_until(over.is_set, scenario, database, address, realtime_process)
        except InputError as fault:
            raise SystemExit(f"slipbench vehicle: {fault}") from fault

"""Virtual motorcycle in real time: as a command, or as a process beside a trial."""

import copyreg
import multiprocessing
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from types import MappingProxyType
from typing import Any

from slipbench.bench.bus.opening import BusAddress, bus_failure_as_input_error, open_buses
from slipbench.bench.loop.clock import MILLISECOND, MonotonicClock
from slipbench.bench.loop.exit_status import exit_reason
from slipbench.bench.loop.interrupts import ignore_interrupts, interrupts, start
from slipbench.bench.loop.loop import run_ticks
from slipbench.bench.loop.process_watch import process_pipe
from slipbench.bench.loop.realtime_process import realtime_process, signal_on_parent_exit
from slipbench.bench.vehicle.virtual_motorcycle import Scenario, VirtualMotorcycle
from slipbench.protocol.binding.binding import Binding
from slipbench.protocol.errors import InputError

END_TIMEOUT = 10.0  # s within which the vehicle process must end when asked to
LISTENING = 200  # ms, before the first frame: another sender for a simulated node shows itself
SPIN = 20_000  # ns: short, because the bench needs the processor more than the motorcycle does


def _view(of: dict[str, Any]) -> MappingProxyType[str, Any]:
    return MappingProxyType(of)


# Tables of a vehicle are read-only views. Pickle does not know them and sends what they view.
copyreg.pickle(MappingProxyType, lambda view: (_view, (dict(view),)))


def simulate_until(
    over: Callable[[], bool],
    scenario: Scenario,
    binding: Binding,
    addresses: Sequence[BusAddress],
    scheduling: Callable[[], AbstractContextManager[object]] = nullcontext,
    ready: Callable[[], None] = lambda: None,
    waiting: Callable[[tuple[str, ...]], None] = lambda _: None,
) -> VirtualMotorcycle:
    """Final state of the virtual motorcycle, simulated until `over` returns True.

    addresses   of the buses, in the order of the binding
    scheduling  context in which the simulation runs, such as `realtime_process`
    ready       called when the buses are open and free, before the first millisecond
    waiting     receives the nodes left to real devices that have not sent yet, whenever they change

    Raises InputError where the bus cannot be opened, or fails during the simulation, where another
    device sends for a simulated node, and where a real device is silent or late.
    """
    with (
        open_buses(addresses, receive_own_messages=False) as buses,
        bus_failure_as_input_error(addresses),
    ):
        motorcycle = VirtualMotorcycle(scenario, buses, binding.codec())

        def listen(_number: int, _due: int) -> bool:
            motorcycle.listen()
            return True

        waited_for: tuple[str, ...] = ()

        def tick(number: int, due: int) -> bool:
            nonlocal waited_for
            if motorcycle.waited_for != waited_for:
                waited_for = motorcycle.waited_for
                waiting(waited_for)
            return motorcycle.tick(number, due) and not over()

        run_ticks(listen, MILLISECOND, MonotonicClock(), LISTENING)
        ready()
        with scheduling():
            run_ticks(tick, MILLISECOND, MonotonicClock(SPIN))
        return motorcycle


@dataclass(frozen=True)
class VehicleProcess:
    """Process that simulates the motorcycle. pipe: the kernel closes it when the process ends."""

    process: BaseProcess
    pipe: Connection

    def why_ended(self) -> str:
        """How the process died, in words; empty where it runs or ended without an error."""
        return exit_reason(self.process)


@contextmanager
def vehicle_process(
    scenario: Scenario, binding: Binding, addresses: Sequence[BusAddress]
) -> Iterator[VehicleProcess]:
    """Process that simulates the motorcycle on the buses at `addresses` until the block ends."""
    watching, watched = process_pipe()
    process = multiprocessing.get_context("spawn").Process(
        target=_simulate, args=(scenario, binding, addresses, watched), name="slipbench vehicle"
    )
    try:
        start(process)
        watched.close()
        yield VehicleProcess(process, watching)
    finally:
        watching.close()
        if process.pid is not None:
            process.terminate()
            process.join(END_TIMEOUT)
        if process.is_alive():  # stopped or blocked; it has no data that could be lost
            process.kill()
            process.join()


def _simulate(
    scenario: Scenario, binding: Binding, addresses: Sequence[BusAddress], _pipe: Connection
) -> None:
    """Simulate until SIGTERM; signals of the terminal are handled by the process of the trial."""
    signal_on_parent_exit(signal.SIGTERM)
    over = threading.Event()
    with interrupts(over):
        ignore_interrupts()
        try:
            simulate_until(over.is_set, scenario, binding, addresses, realtime_process)
        except InputError as fault:
            raise SystemExit(f"slipbench vehicle: {fault}") from fault

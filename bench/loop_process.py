"""The loop as a process of its own: it opens the bus, runs the ticks and reports at the end.

Between its start and its report it speaks to other processes only through two rings in shared
memory: frames and ticks for the recorder, phases for whoever watches.
"""

import copyreg
import signal
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from types import FrameType, MappingProxyType
from typing import Any

import can

from bench.buses import BusAddress, open_bus
from bench.clock import SECOND, MonotonicClock
from bench.gateway import Gateway, PhaseChange
from bench.live_vehicle import riding
from bench.lookout import Wheels
from bench.loop import Lateness, Tick, run_periodic
from bench.ring import PHASE, Ring, attach_shared
from bench.ticks import noting
from bench.trial import Plan, TrialState
from bench.undisturbed import die_with, undisturbed
from bench.virtual_motorcycle import Ride
from protocol.errors import InputError
from protocol.layout import Database
from protocol.messages import Phase

PHASES = 1 << 10  # phases that wait for whoever watches; more are only in the report


def _view(of: dict[str, Any]) -> MappingProxyType[str, Any]:
    return MappingProxyType(of)


# A vehicle's tables are read-only views, which pickle does not know; they travel as what they view.
copyreg.pickle(MappingProxyType, lambda view: (_view, (dict(view),)))


@dataclass(frozen=True)
class LoopOrder:
    """What the loop needs.

    frames, phases  names of rings in shared memory
    ride            what rides along in a thread, where the bus does not leave the process
    """

    plan: Plan
    database: Database
    wheels: Wheels
    address: BusAddress
    frames: str
    phases: str
    ride: Ride | None = None


@dataclass(frozen=True)
class LoopReport:
    """What became of the trial, and what the operating system refused."""

    state: TrialState
    changes: tuple[PhaseChange, ...]
    lateness: Lateness
    notes: tuple[str, ...]


def serve(order: LoopOrder, pipe: Connection) -> None:
    """Open the bus and say so, wait for the word to begin, run, report; the process's main."""
    die_with(signal.SIGTERM)
    stop = threading.Event()
    with interrupts(stop), ExitStack() as open_things:
        try:
            bus = open_things.enter_context(open_bus(order.address, hears_itself=True))
        except InputError as fault:
            pipe.send(fault)
            return
        frames = open_things.enter_context(shared_ring(order.frames))
        phases = open_things.enter_context(shared_ring(order.phases, PHASES))
        pipe.send(None)
        try:
            pipe.recv()
        except EOFError:  # whoever started this had something against it
            return
        if order.ride is not None:
            open_things.enter_context(riding(order.ride, order.database, order.address))
        pipe.send(run_loop(order, bus, frames, phases, stop))


def run_loop(
    order: LoopOrder, bus: can.BusABC, frames: Ring, phases: Ring, stop: threading.Event
) -> LoopReport:
    """Run the gateway's ticks until the trial has ended; `stop` ends it by a release."""
    gateway = Gateway(order.plan, bus, order.database, frames, order.wheels)
    period = round(order.plan.trial.command.period * SECOND)
    tick = _telling(gateway, phases, stop)
    with undisturbed() as refused:
        lateness = run_periodic(tick, period, MonotonicClock(), note=noting(frames))
    frames.close()
    notes = (*refused, *gateway.refusals)
    return LoopReport(gateway.state, tuple(gateway.changes), lateness, notes)


def _telling(gateway: Gateway, phases: Ring, stop: threading.Event) -> Tick:
    """Wrap the gateway's tick: an interrupt stops the trial, and a new phase is told."""
    told = 0

    def tick(number: int, due: int) -> bool:
        nonlocal told
        if stop.is_set():
            gateway.stop(due)
        goes_on = gateway.tick(number, due)
        while told < len(gateway.changes):
            change = gateway.changes[told]
            phases.append(change.time_ns, change.phase, PHASE, b"")
            told += 1
        return goes_on

    return tick


def drain_phases(phases: Ring) -> list[PhaseChange]:
    """Take out the phases that were told since the last look."""
    return [PhaseChange(Phase(slot.identifier), slot.time_ns) for slot in phases.drain()]


@contextmanager
def shared_ring(name: str, slots: int = 1 << 16) -> Iterator[Ring]:
    """Open a ring that another process made, for as long as the block lasts."""
    memory, ring = attach_shared(name, slots)
    try:
        yield ring
    finally:
        ring.release()
        memory.close()


@contextmanager
def interrupts(stop: threading.Event) -> Iterator[None]:
    """Let the operator's Ctrl-C, or a polite kill, ask for the end of the trial."""

    def ask(_signal: int, _frame: FrameType | None) -> None:
        stop.set()

    before = {number: signal.signal(number, ask) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def ended(process: BaseProcess) -> str:
    """Say how a process ended that ought not to have; empty where it lives or ended well."""
    status = process.exitcode
    if not status:
        return ""
    return f"signal {-status}" if status < 0 else f"exit status {status}"

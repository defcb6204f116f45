"""Process of the loop: it opens the bus, runs the ticks and reports at the end.

Between its start and its report it sends data to other processes only through two rings in shared
memory: frames and ticks to the recorder, phases to the process of the command.
"""

import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection

import can

from slipbench.bench.bus.opening import BusAddress, open_buses, receive_buffer, stamps_wall_time
from slipbench.bench.gateway.gateway import Gateway, PhaseChange
from slipbench.bench.gateway.stamps import SteadyStamps, as_stamped
from slipbench.bench.loop.button_wait import button_wait
from slipbench.bench.loop.clock import SECOND, SPIN, MonotonicClock
from slipbench.bench.loop.interrupts import interrupts
from slipbench.bench.loop.loop import Lateness, Tick, run_periodic
from slipbench.bench.loop.process_watch import ProcessWatch
from slipbench.bench.loop.realtime_process import (
    NO_SPIN,
    one_processor,
    realtime_process,
    signal_on_parent_exit,
)
from slipbench.bench.loop.ring import PHASE, Ring, attach_shared
from slipbench.bench.loop.ticks import tick_recorder
from slipbench.bench.safety.trial import Plan, TrialState
from slipbench.bench.safety.vehicle_monitor import Wheels
from slipbench.protocol.binding.binding import Binding
from slipbench.protocol.codec.messages import Phase
from slipbench.protocol.errors import InputError

VEHICLE_ENDED = "the process of the virtual motorcycle has ended"
PHASES = 1 << 10  # capacity of the ring of phases; further ones are only in the report


@dataclass(frozen=True)
class LoopOrder:
    """Parameters of the loop process.

    addresses       of the buses, in the order of the binding
    frames, phases  names of rings in shared memory
    recorder        pipe whose other end the recorder holds
    vehicle         pipe whose other end the process of the virtual motorcycle holds, if there is one
    """

    plan: Plan
    binding: Binding
    wheels: Wheels
    addresses: Sequence[BusAddress]
    frames: str
    phases: str
    recorder: Connection
    vehicle: Connection | None = None


@dataclass(frozen=True)
class LoopReport:
    """Result of the trial, lateness of its ticks, and notes on refused real-time rights."""

    state: TrialState
    changes: tuple[PhaseChange, ...]
    lateness: Lateness
    notes: tuple[str, ...]


def serve(order: LoopOrder, pipe: Connection) -> None:
    """Open the bus and report it, wait for the start, run, report: main function of the process."""
    signal_on_parent_exit(signal.SIGTERM)
    stop = threading.Event()
    with interrupts(stop), ExitStack() as open_things:
        try:
            buses = open_things.enter_context(
                open_buses(order.addresses, receive_own_messages=True)
            )
        except InputError as fault:
            with suppress(ConnectionError):  # the parent may have been interrupted
                pipe.send(fault)
            return
        frames = open_things.enter_context(shared_ring(order.frames))
        phases = open_things.enter_context(shared_ring(order.phases, PHASES))
        try:
            pipe.send(min(filter(None, map(receive_buffer, buses)), default=None))
            pipe.recv()
        except (EOFError, ConnectionError):  # the parent ended before the start
            return
        pipe.send(run_loop(order, buses, frames, phases, stop))


def run_loop(
    order: LoopOrder, buses: Sequence[can.BusABC], frames: Ring, phases: Ring, stop: threading.Event
) -> LoopReport:
    """Report after running the ticks of the gateway until the trial has ended.

    `stop` aborts the trial: the gateway returns control to the rider.
    """
    alone = one_processor()
    clock = MonotonicClock(0 if alone else SPIN)
    stamps = [SteadyStamps(clock) if stamps_wall_time(bus) else as_stamped for bus in buses]
    gateway = Gateway(order.plan, buses, order.binding, frames, order.wheels, stamps)
    period = round(order.plan.trial.command.period * SECOND)
    tick = _watching(order, gateway, frames, _reporting(gateway, phases, stop))
    with realtime_process() as refused:
        for bus in buses:
            _discard_waiting(bus)
        wait = button_wait(gateway, buses, clock)
        lateness = run_periodic(
            tick,
            period,
            clock,
            observer=tick_recorder(frames),
            wait=wait,
            refused=lambda: gateway.refused,
        )
    frames.close()
    notes = (*refused, *([NO_SPIN] if alone else ()), *gateway.refusals)
    return LoopReport(gateway.state, tuple(gateway.changes), lateness, notes)


def _discard_waiting(bus: can.BusABC) -> None:
    """Discard frames from before the first tick; they would all get the same arrival time."""
    try:
        while bus.recv(0) is not None:
            pass
    except can.CanError:
        return  # the first tick gets the error again, and reports it


def _reporting(gateway: Gateway, phases: Ring, stop: threading.Event) -> Tick:
    """Tick of the gateway that also applies `stop` and writes new phases to the ring."""
    reported = 0

    def tick(number: int, due: int) -> bool:
        nonlocal reported
        if stop.is_set():
            gateway.stop(due)
        goes_on = gateway.tick(number, due)
        while reported < len(gateway.changes):
            change = gateway.changes[reported]
            phases.append(change.time_ns, change.phase, PHASE, b"")
            reported += 1
        return goes_on

    return tick


def _watching(order: LoopOrder, gateway: Gateway, frames: Ring, tick: Tick) -> Tick:
    """Tick that first checks whether the recorder or the vehicle process has ended.

    An ended recorder marks the ring as failed; an ended vehicle stops the trial.
    """
    recorder = ProcessWatch(order.recorder)
    vehicle = None if order.vehicle is None else ProcessWatch(order.vehicle)

    def watched(number: int, due: int) -> bool:
        if recorder.ended():
            frames.fail()  # the gateway reads this in the same tick, and releases authority
        if vehicle is not None and vehicle.ended():
            gateway.stop(due, VEHICLE_ENDED)
        return tick(number, due)

    return watched


def drain_phases(phases: Ring) -> list[PhaseChange]:
    """Remove and return the phases that were reported since the last call."""
    return [PhaseChange(Phase(slot.identifier), slot.time_ns) for slot in phases.drain()]


@contextmanager
def shared_ring(name: str, slots: int = 1 << 16) -> Iterator[Ring]:
    """Ring in shared memory of another process, open until the block ends."""
    memory, ring = attach_shared(name, slots)
    try:
        yield ring
    finally:
        ring.release()
        memory.close()

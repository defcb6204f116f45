"""A trial in real time, on whatever bus python-can opens."""

import gc
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import FrameType

import can

from bench.buses import BusAddress
from bench.clock import SECOND, Clock, MonotonicClock
from bench.gateway import Gateway
from bench.live_vehicle import riding
from bench.loop import Lateness, run_periodic
from bench.outcome import Outcome
from bench.preparation import Prepared
from bench.recorder import JOIN, start_recorder
from bench.ring import Ring, create_shared
from bench.virtual_motorcycle import wheels_of
from protocol.messages import Phase

PRIORITY = 80  # of SCHED_FIFO: above everything but the kernel's own threads


def run_live(
    prepared: Prepared,
    log_path: Path,
    bus: can.BusABC,
    address: BusAddress,
    told: Callable[[Phase], None],
) -> Outcome:
    """Run the trial on `bus`, opened at `address`, and write its frames to `log_path`.

    On python-can's "virtual" interface, which ends at this process, the virtual motorcycle rides
    along in a thread; elsewhere a vehicle, virtual or real, is expected on the bus. `told` is
    called, from a thread of its own, with each phase that the trial enters.
    """
    alone = address.interface == "virtual"
    memory, ring = create_shared()
    recorder = start_recorder(memory.name, log_path, address.name)
    try:
        wheels = wheels_of(prepared.ride.vehicle)
        gateway = Gateway(prepared.plan, bus, prepared.database, ring, wheels)
        riders = riding(prepared.ride, prepared.database, address) if alone else nullcontext()
        with riders, _telling(gateway, told):
            lateness, notes = _loop(gateway, round(prepared.trial.command.period * SECOND))
        notes = (*notes, *gateway.refusals, *_finish(ring, recorder))
        return Outcome(gateway.state, tuple(gateway.changes), lateness, notes)
    finally:
        ring.close()
        recorder.join(JOIN)
        ring.release()
        memory.close()
        memory.unlink()


def _loop(gateway: Gateway, period: int) -> tuple[Lateness, tuple[str, ...]]:
    """Run the gateway's ticks; an interrupt ends the trial by a release, not by silence.

    Returns with the lateness what the operating system refused the loop.
    """
    clock: Clock = MonotonicClock()
    stop = threading.Event()

    def tick(number: int, due: int) -> bool:
        if stop.is_set():
            gateway.stop(due)
        return gateway.tick(number, due)

    with interrupts(stop), _undisturbed() as refused:
        return run_periodic(tick, period, clock), tuple(refused)


def _finish(ring: Ring, recorder: BaseProcess) -> tuple[str, ...]:
    """Let the recorder write what is left, and say what it could not."""
    ring.close()
    recorder.join(JOIN)
    if recorder.exitcode is None:
        recorder.kill()
        return ("the recorder did not finish and was ended",)
    if recorder.exitcode != 0 or ring.failed:
        return (f"the recorder failed (exit status {recorder.exitcode})",)
    return ()


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


@contextmanager
def _undisturbed() -> Iterator[list[str]]:
    """Keep the garbage collector, and other programs where that is allowed, out of the loop.

    Yields what was refused.
    """
    gc.collect()
    gc.freeze()
    gc.disable()
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    refused = []
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except OSError as cause:
        refused.append(f"real-time scheduling (SCHED_FIFO) was refused: {cause.strerror}")
    try:
        yield refused
    finally:
        if not refused:
            os.sched_setscheduler(0, *before)
        gc.enable()
        gc.unfreeze()


@contextmanager
def _telling(gateway: Gateway, told: Callable[[Phase], None]) -> Iterator[None]:
    """Tell the phases from a thread that sleeps in between; the loop itself tells nobody."""
    over = threading.Event()

    def watch() -> None:
        known = 0
        while True:
            last_round = over.wait(0.1)
            changes = gateway.changes
            for change in changes[known:]:
                told(change.phase)
            known = len(changes)
            if last_round:
                return

    thread = threading.Thread(target=watch, name="slipbench phases", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()

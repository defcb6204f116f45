"""A trial in real time, on whatever bus python-can opens: three processes and two rings.

The loop has its own process, which no other work can hold up, and the recorder another; this one
watches both, reports the phases, and completes the record when one of them dies.
"""

import multiprocessing
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from time import monotonic
from types import FrameType

from slipbench.bench.bus.opening import BusAddress, shown
from slipbench.bench.loop.exit_status import exit_reason
from slipbench.bench.loop.interrupts import start, termination_signals
from slipbench.bench.loop.liveness import Liveness
from slipbench.bench.loop.loop_process import PHASES, LoopOrder, LoopReport, drain_phases, serve
from slipbench.bench.loop.process_watch import process_pipe
from slipbench.bench.loop.recorder import JOIN, recorder_failure, start_recorder
from slipbench.bench.loop.ring import Ring, create_shared
from slipbench.bench.loop.ticks import TICKS, read_ticks, tick_table
from slipbench.bench.safety.trial import TrialState
from slipbench.bench.trials.outcome import Outcome
from slipbench.bench.trials.preparation import Prepared
from slipbench.bench.trials.progress import script_time
from slipbench.bench.vehicle.live_vehicle import VehicleProcess
from slipbench.bench.vehicle.virtual_motorcycle import wheels_of
from slipbench.protocol.codec.messages import Phase
from slipbench.protocol.errors import InputError

LOOK = 0.1  # s between two looks at the processes
GLANCE = 0.01  # s between two looks for the recorder
OPENING = 60.0  # s that a bus has to open, and a recorder to begin, on a machine however loaded
STANDING = 15.0  # s without a tick after which a loop that lives is ended: it was stopped
OnPhase = Callable[[Phase], None]


class LiveTrial:
    """A loop that has opened its bus and waits for the start."""

    def __init__(
        self,
        loop: BaseProcess,
        pipe: Connection,
        frames: Ring,
        phases: Ring,
        order: LoopOrder,
        receive_buffer: int | None,
        recorder: Connection,
        vehicle: VehicleProcess | None = None,
    ) -> None:
        """Watch `loop`, which listens at the other end of `pipe`.

        recorder  end of a pipe for the recorder to hold: it closes when the recorder dies
        vehicle   process of the virtual motorcycle, where the trial has one
        """
        self._recorder_pipe, self._vehicle = recorder, vehicle
        self.receive_buffer = receive_buffer
        self._loop, self._pipe, self._order = loop, pipe, order
        self._frames, self._phases = frames, phases
        self._report: LoopReport | None = None
        self._over = False
        self._pulse = Liveness(frames, round(STANDING / LOOK))
        self._known = TrialState()
        self._notes: list[str] = []

    def run(
        self, folder: Path, on_phase: OnPhase, progress: Callable[[float], None] = lambda _: None
    ) -> Outcome:
        """Run the trial, frames and ticks into `folder`; on_phase: receives each phase as it begins.

        progress: receives, ten times a second, the seconds of the trial's script that are over.
        """
        trial, since = self._order.plan.trial, monotonic()
        table = tick_table(trial)
        recorder = start_recorder(
            self._order.frames,
            folder,
            [address.name for address in self._order.addresses],
            table,
            self._recorder_pipe,
        )
        if not _begun(recorder, folder / TICKS):
            self._frames.fail()  # the loop reads it in its first tick and trips
        self._pipe.send("begin")
        changes = []
        while self._running():
            for change in drain_phases(self._phases):
                changes.append(change)
                self._known, since = TrialState(change.phase), monotonic()
                on_phase(change.phase)
            progress(script_time(trial, self._known.phase, monotonic() - since))
        self._frames.close()
        self._notes += _finish(recorder, self._frames)
        if self._vehicle is not None and (why := self._vehicle.why_ended()):
            self._notes.append(f"the virtual motorcycle's process died ({why})")
        if self._report is not None:
            report = self._report
            return Outcome(
                report.state, report.changes, report.lateness, (*report.notes, *self._notes)
            )
        died = f"the loop's process died ({exit_reason(self._loop) or 'without a report'})"
        lateness = read_ticks(folder / TICKS, table.period)
        return Outcome(self._known, tuple(changes), lateness, (died, *self._notes), died)

    def _running(self) -> bool:
        """Wait a moment for the report, and notice a loop that died; False once all is received."""
        if self._over:
            return False  # the phases reported with the outcome have been read meanwhile
        self._pipe.poll(LOOK)
        if self._pulse.stopped() and not self._pipe.poll():
            self._notes.append(f"the loop's process stood still for {STANDING:g} s and was ended")
            self._loop.kill()
        if self._pipe.poll():
            self._over = True
            try:
                self._report = self._pipe.recv()
            except (EOFError, ConnectionError):  # it died
                self._loop.join(JOIN)
        return True


@contextmanager
def live_trial(
    prepared: Prepared, addresses: Sequence[BusAddress], vehicle: VehicleProcess | None = None
) -> Iterator[LiveTrial]:
    """Start the loop's process; raises InputError where it cannot open the buses at `addresses`.

    A vehicle, virtual or real, is expected on them; the trial ends with the process `vehicle`.
    """
    spawning = multiprocessing.get_context("spawn")
    ours, theirs = spawning.Pipe()
    watching, watched = process_pipe()
    with _ring() as (frames_name, frames), _ring(PHASES) as (phases_name, phases):
        order = LoopOrder(
            prepared.plan,
            prepared.binding,
            wheels_of(prepared.scenario.vehicle),
            addresses,
            frames_name,
            phases_name,
            watching,
            None if vehicle is None else vehicle.pipe,
        )
        loop = spawning.Process(target=serve, args=(order, theirs), name="slipbench loop")
        with _interrupts_passed_on(loop) as interrupted:
            try:
                start(loop)
                theirs.close()
                watching.close()
                room = _opened(ours, loop, addresses, interrupted)
                yield LiveTrial(loop, ours, frames, phases, order, room, watched, vehicle)
            finally:
                ours.close()
                watched.close()
                frames.close()
                theirs.close()
                if loop.pid is not None:
                    loop.join(JOIN)
                if loop.is_alive():
                    loop.kill()
                    loop.join()


def _opened(
    pipe: Connection,
    loop: BaseProcess,
    addresses: Sequence[BusAddress],
    interrupted: threading.Event,
) -> int | None:
    """Wait until the buses are open; returns the bytes of frames that the kernel keeps for each.

    Raises InputError where it cannot be opened, or does not open; KeyboardInterrupt where the
    operator stopped it meanwhile.
    """
    try:
        if not pipe.poll(OPENING):
            loop.kill()  # its driver hangs and would not react to a signal
            raise InputError(
                f"the CAN bus does not open: {shown(addresses)}",
                expected=f"an answer within {OPENING:g} s",
                found="none",
                remedy="does its driver hang? unplug the adapter, or try another program on it",
            )
        response: int | InputError | None = pipe.recv()
    except EOFError as cause:
        loop.join(JOIN)
        if interrupted.is_set():
            raise KeyboardInterrupt from cause
        raise RuntimeError(f"the loop's process did not start ({exit_reason(loop)})") from cause
    if isinstance(response, InputError):
        raise response
    if interrupted.is_set():  # the loop had opened its bus before the interrupt
        raise KeyboardInterrupt
    return response


def _begun(recorder: BaseProcess, path: Path) -> bool:
    """Wait until the recorder has made `path`: a trial begins when it can be recorded."""
    for _ in range(round(OPENING / GLANCE)):
        if path.exists() or recorder.exitcode is not None:
            break
        recorder.join(GLANCE)
    return path.exists()


def _finish(recorder: BaseProcess, ring: Ring) -> list[str]:
    """Let the recorder finish; notes on what it could not write."""
    recorder.join(JOIN)
    if recorder.exitcode is None:
        recorder.kill()
        recorder.join()
        return ["the recorder did not finish and was ended"]
    if recorder.exitcode != 0:
        return [f"the recorder's process died ({exit_reason(recorder)})"]
    return recorder_failure(ring)


@contextmanager
def _ring(slots: int = 1 << 16) -> Iterator[tuple[str, Ring]]:
    memory, ring = create_shared(slots)
    try:
        yield memory.name, ring
    finally:
        ring.release()
        memory.close()
        memory.unlink()


@contextmanager
def _interrupts_passed_on(loop: BaseProcess) -> Iterator[threading.Event]:
    """Pass Ctrl-C and other requests to end on to the loop, which returns control to the rider.

    After the loop has ended they have no effect: the outcome is being written.

    Yields an event that is set once the operator has requested the end.
    """
    interrupted = threading.Event()

    def pass_on(_signal: int, _frame: FrameType | None) -> None:
        interrupted.set()
        if loop.is_alive():
            loop.terminate()

    before = {number: signal.signal(number, pass_on) for number in termination_signals()}
    try:
        yield interrupted
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)

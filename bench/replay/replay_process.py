"""A replay as a process of its own, which keeps its deadlines whatever else goes on."""

import multiprocessing
import signal
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from typing import TypeVar

import can
import numpy as np

from slipbench.bench.bus.opening import BusAddress, open_bus
from slipbench.bench.loop.clock import MonotonicClock
from slipbench.bench.loop.exit_status import exit_reason
from slipbench.bench.loop.interrupts import ignore_interrupts, start, start_resource_tracker
from slipbench.bench.loop.realtime_process import (
    NO_SPIN,
    one_processor,
    realtime_process,
    signal_on_parent_exit,
)
from slipbench.bench.replay.replay import ReplayResult, replay
from slipbench.bench.replay.replay_controls import SIZE, Controls
from slipbench.bench.replay.replay_selection import (
    channels_by_bus,
    select_buses,
    select_identifiers,
)
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.frame_log import FrameLog

Answer = TypeVar("Answer")

ENDING = 5.0  # s that the process has to end; its bus may refuse a frame for 2 s of them
SPIN = 100_000  # ns; with frames every 250 us a longer one would take a whole processor


@dataclass(frozen=True)
class ReplayOrder:
    """What is replayed, and where.

    channels  channels of `interface`, one for all or BUS=CHANNEL each
    buses     only these buses of the log, none: all
    only, without  identifiers, as `select_identifiers` reads them
    """

    log: Path
    interface: str
    channels: tuple[str, ...]
    buses: tuple[str, ...] = ()
    only: str = ""
    without: str = ""
    bitrate: int = 1_000_000
    fd: bool = False


@dataclass(frozen=True)
class Ready:
    """A log that was read. span: ns from its first to its last frame; buses: log's -> channel."""

    frames: int
    span: int
    buses: Mapping[str, str]
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Report:
    """What a replay did, in how long (ns), and what the operating system refused it."""

    replayed: ReplayResult
    took: int
    refused: tuple[str, ...]


class RunningReplay:
    """A replay that waits for the word to begin, or runs."""

    def __init__(
        self, pipe: Connection, process: BaseProcess, ready: Ready, controls: Controls
    ) -> None:
        """Steer the replay of `process` by `controls`; it reports through `pipe`."""
        self._pipe, self._process = pipe, process
        self.ready, self.controls = ready, controls

    def begin(self) -> None:
        """Let the first frame go."""
        self._pipe.send("begin")

    def report(self, within: float) -> Report | None:
        """Wait `within` s for the end; None: it goes on. Raises InputError where it failed."""
        if not self._pipe.poll(within):
            return None
        return _received(self._pipe, Report, self._process)


@contextmanager
def running_replay(order: ReplayOrder, speed: float, passes: int) -> Iterator[RunningReplay]:
    """Start the process; raises InputError where the log or a bus cannot be used."""
    spawning = multiprocessing.get_context("spawn")
    ours, theirs = spawning.Pipe()
    with _shared_controls() as (name, controls):
        controls.begin(speed, passes)
        process = spawning.Process(target=_serve, args=(order, name, theirs), name="replay")
        try:
            start(process)
            theirs.close()
            ready = _received(ours, Ready, process)
            yield RunningReplay(ours, process, ready, controls)
        finally:
            controls.stop()
            ours.close()
            theirs.close()
            if process.pid is not None:
                process.join(ENDING)
            if process.is_alive():
                process.kill()
                process.join()


def _serve(order: ReplayOrder, controls_name: str, pipe: Connection) -> None:
    """Read, open, say so, wait for the word, replay, report; the process's main."""
    signal_on_parent_exit(signal.SIGTERM)
    ignore_interrupts()  # who started this stops it by the controls
    with ExitStack() as stack:
        _, controls = stack.enter_context(_shared_controls(controls_name))
        try:
            log, channels, warnings = _read(order)
            outputs = _open(order, log, channels, stack)
            pipe.send(Ready(len(log), int(np.ptp(log.time_ns)), channels, warnings))
            pipe.recv()
            pipe.send(_run(log, outputs, controls))
        except InputError as fault:
            with suppress(ConnectionError):  # whoever started this may have been interrupted
                pipe.send(fault)
        except (EOFError, ConnectionError):  # whoever started this ended before it began
            return


def _read(order: ReplayOrder) -> tuple[FrameLog, Mapping[str, str], tuple[str, ...]]:
    reading = read_log(order.log)
    log = select_buses(reading.frames, order.buses, str(order.log))
    log = select_identifiers(log, order.only, order.without)
    channels = channels_by_bus(order.channels, log)
    log = select_buses(log, tuple(channels), str(order.log))
    if not len(log):
        raise InputError("nothing is left to replay", where=str(order.log), remedy="ask for more")
    beside = tuple(f"{count} {kind} are not replayed" for kind, count in log.skipped)
    return log, channels, (*reading.warnings, *beside)


def _open(
    order: ReplayOrder, log: FrameLog, channels: Mapping[str, str], stack: ExitStack
) -> list[can.BusABC]:
    """Open every channel once; gives the bus for each bus of the log."""
    opened = {}
    for channel in dict.fromkeys(channels.values()):
        address = BusAddress(order.interface, channel, order.bitrate, order.fd)
        opened[channel] = stack.enter_context(
            open_bus(address, receive_own_messages=False, in_order=True)
        )
    return [opened[channels[bus]] for bus in log.buses]


def _run(log: FrameLog, outputs: list[can.BusABC], controls: Controls) -> Report:
    alone = one_processor()
    clock = MonotonicClock(0 if alone else SPIN)
    with realtime_process(shares_one_processor=alone) as refused:
        began = clock.now_ns()
        try:
            replayed = replay(log, outputs, clock, controls)
        except can.CanError as cause:
            raise InputError(
                f"the bus refuses frames after {controls.sent} were replayed",
                found=str(cause),
                remedy="is another node on the bus that acknowledges them, and the bit rate right?",
            ) from cause
        took = clock.now_ns() - began
    return Report(replayed, took, (*refused, *([NO_SPIN] if alone else ())))


def _received(pipe: Connection, kind: type[Answer], process: BaseProcess) -> Answer:
    try:
        answer = pipe.recv()
    except (EOFError, ConnectionError) as cause:
        process.join(ENDING)
        raise InputError(
            "the replay's process died",
            found=exit_reason(process) or "no report of it",
            remedy="is there memory enough for the whole log? see the system's own log",
        ) from cause
    if isinstance(answer, InputError):
        raise answer
    assert isinstance(answer, kind)
    return answer


@contextmanager
def _shared_controls(name: str | None = None) -> Iterator[tuple[str, Controls]]:
    """Make controls in shared memory, or open those of that name."""
    start_resource_tracker()
    memory = SharedMemory(name=name, create=name is None, size=SIZE)
    assert memory.buf is not None
    controls = Controls(memory.buf)
    try:
        yield memory.name, controls
    finally:
        controls.release()
        memory.close()
        if name is None:
            memory.unlink()

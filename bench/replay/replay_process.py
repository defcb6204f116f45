"""Process of a replay, which keeps its deadlines while the command shows progress."""

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

Reply = TypeVar("Reply")

END_TIMEOUT = 5.0  # s for the process to end; a bus may refuse a frame for 2 s of this time
SPIN = 100_000  # ns; with a frame every 250 us, a longer busy wait would use a whole processor


@dataclass(frozen=True)
class ReplayOrder:
    """Frames to replay, and the buses to replay them on.

    channels  channels of `interface`: one for all buses, or BUS=CHANNEL for each
    buses     buses of the log to replay; empty: all
    only, without  identifiers, in the format of `select_identifiers`
    bitrate   bit/s
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
    """A log that was read. span: ns from first to last frame; buses: bus of the log -> channel."""

    frames: int
    span: int
    buses: Mapping[str, str]
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Report:
    """Result of a replay. took: duration, ns; refused: real-time rights that were refused."""

    replayed: ReplayResult
    took: int
    refused: tuple[str, ...]


class RunningReplay:
    """A replay that is ready to begin, or runs."""

    def __init__(
        self, pipe: Connection, process: BaseProcess, ready: Ready, controls: Controls
    ) -> None:
        """Control the replay of `process` by `controls`; it reports through `pipe`."""
        self._pipe, self._process = pipe, process
        self.ready, self.controls = ready, controls

    def begin(self) -> None:
        """Start the replay."""
        self._pipe.send("begin")

    def report(self, within: float) -> Report | None:
        """Report, or None where the replay still runs after `within` s. Raises InputError."""
        if not self._pipe.poll(within):
            return None
        return _received(self._pipe, Report, self._process)


@contextmanager
def running_replay(order: ReplayOrder, speed: float, passes: int) -> Iterator[RunningReplay]:
    """Replay that is ready to begin, until the block ends.

    Raises InputError where the log cannot be read or a bus cannot be opened.
    """
    spawning = multiprocessing.get_context("spawn")
    own_end, child_end = spawning.Pipe()
    with _shared_controls() as (name, controls):
        controls.begin(speed, passes)
        process = spawning.Process(target=_serve, args=(order, name, child_end), name="replay")
        try:
            start(process)
            child_end.close()
            ready = _received(own_end, Ready, process)
            yield RunningReplay(own_end, process, ready, controls)
        finally:
            controls.stop()
            own_end.close()
            child_end.close()
            if process.pid is not None:
                process.join(END_TIMEOUT)
            if process.is_alive():
                process.kill()
                process.join()


def _serve(order: ReplayOrder, controls_name: str, pipe: Connection) -> None:
    """Read the log, open the buses, wait for the start, replay, report: main of the process."""
    signal_on_parent_exit(signal.SIGTERM)
    ignore_interrupts()  # the parent stops it by the controls
    with ExitStack() as stack:
        _, controls = stack.enter_context(_shared_controls(controls_name))
        try:
            log, channels, warnings = _read(order)
            outputs = _open(order, log, channels, stack)
            pipe.send(Ready(len(log), int(np.ptp(log.time_ns)), channels, warnings))
            pipe.recv()
            pipe.send(_run(log, outputs, controls))
        except InputError as fault:
            with suppress(ConnectionError):  # the parent may have been interrupted
                pipe.send(fault)
        except (EOFError, ConnectionError):  # the parent ended before the start
            return


def _read(order: ReplayOrder) -> tuple[FrameLog, Mapping[str, str], tuple[str, ...]]:
    reading = read_log(order.log)
    log = select_buses(reading.frames, order.buses, str(order.log))
    log = select_identifiers(log, order.only, order.without)
    channels = channels_by_bus(order.channels, log)
    log = select_buses(log, tuple(channels), str(order.log))
    if not len(log):
        raise InputError(
            "no frame of the log is selected",
            where=str(order.log),
            remedy="change --bus, --only, --without or --channel",
        )
    beside = tuple(f"{count} {kind} are not replayed" for kind, count in log.skipped)
    return log, channels, (*reading.warnings, *beside)


def _open(
    order: ReplayOrder, log: FrameLog, channels: Mapping[str, str], stack: ExitStack
) -> list[can.BusABC]:
    """Open bus for each bus of the log; every channel is opened once."""
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
                f"the bus refused a frame after {controls.sent} sent frames",
                found=str(cause),
                remedy="check that another node acknowledges frames, and the bit rate",
            ) from cause
        took = clock.now_ns() - began
    return Report(replayed, took, (*refused, *([NO_SPIN] if alone else ())))


def _received(pipe: Connection, kind: type[Reply], process: BaseProcess) -> Reply:
    try:
        reply = pipe.recv()
    except (EOFError, ConnectionError) as cause:
        process.join(END_TIMEOUT)
        raise InputError(
            "the replay process died",
            found=exit_reason(process) or "no report",
            remedy="check that the whole log fits into memory, and read the system log",
        ) from cause
    if isinstance(reply, InputError):
        raise reply
    assert isinstance(reply, kind)
    return reply


@contextmanager
def _shared_controls(name: str | None = None) -> Iterator[tuple[str, Controls]]:
    """Name and controls in shared memory: new ones, or those of `name`."""
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

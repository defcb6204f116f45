"""The bus of a test: nodes, time that passes, and every signal by its name."""

import heapq
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import can

from slipbench.bench.loop.clock import SECOND
from slipbench.bench.loop.ring import BIT_RATE_SWITCH, EXTENDED, FD, REMOTE
from slipbench.bench.testing.conditions import (
    Condition,
    SignalOf,
    condition,
    converted,
    find_message,
    find_signal,
    seconds,
)
from slipbench.bench.testing.lines import Line
from slipbench.bench.testing.traffic import Floats, Traffic, TrafficFrame
from slipbench.protocol.database.layout import Database
from slipbench.protocol.errors import InputError

# Reads a frame and its time, ns; called for every data frame.
Watcher = Callable[[TrafficFrame], None]


class SignalTimeoutError(AssertionError):
    """A signal did not do within the time allowed what a test waits for."""


class Tick(Protocol):
    """Work that is due at a time of the bus. Returns False when it must not be called again."""

    def __call__(self, number: int, due: int) -> bool:
        """Run call `number` (from 0), due at `due` (ns)."""


@dataclass(order=True)
class _Task:
    due: int
    order: int
    period: int = field(compare=False)
    tick: Tick = field(compare=False)
    number: int = field(compare=False, default=0)


class BenchBus:
    """A CAN bus and its time. Time passes in `run` and in waits only, unless it is real time.

    Signals are named "Message.signal"; values are in the database's unit, or in a unit that is
    given. Times are s since the bus began.
    """

    def __init__(self, line: Line, database: Database) -> None:
        """Listen on `line`; names and units are those of `database`."""
        self.database, self._line = database, line
        self.traffic = Traffic(line.now_ns())
        self.watched: dict[str, SignalOf] = {}  # signals that the test reads, for plots
        self.marks: list[tuple[float, float, str]] = []  # begin and end (s) of what was injected
        self.lateness = 0.0  # s, longest time by which something ran late, in real time
        self._tasks: list[_Task] = []
        self._order = 0
        self._watchers: list[Watcher] = []
        self._begun = False

    @property
    def now(self) -> float:
        """Time in s since the bus began."""
        return (self._line.now_ns() - self.traffic.origin_ns) / SECOND

    @property
    def real_time(self) -> bool:
        """Whether the clock is that of the machine."""
        return self._line.real_time

    @property
    def line(self) -> Line:
        """The bus itself and its clock, in ns."""
        return self._line

    def node(self, name: str, receive_own_messages: bool = False) -> can.BusABC:
        """New node on this bus, as an ordinary bus of python-can. name: in fault plans."""
        return self._line.node(name, receive_own_messages)

    def every(self, period: float | str, tick: Tick, phase: float = 0.0) -> None:
        """Call `tick` every `period` (s) from `phase` (s) from now on, until it returns False."""
        self.schedule(round(seconds(period) * SECOND), tick, round(phase * SECOND))

    def schedule(self, period: int, tick: Tick, phase: int = 0) -> None:
        """Call `tick` as `every` does; period, phase: ns."""
        self._order += 1
        heapq.heappush(self._tasks, _Task(self._line.now_ns() + phase, self._order, period, tick))

    def watch(self, watcher: Watcher) -> None:
        """Call `watcher` with every data frame, at the time of the frame."""
        self._watchers.append(watcher)

    def unwatch(self, watcher: Watcher) -> None:
        """Do not call `watcher` any more."""
        self._watchers.remove(watcher)

    def run(self, duration: float | str) -> None:
        """Let time pass: s, or a text such as "20 ms"."""
        self.run_until_ns(self._line.now_ns() + round(seconds(duration) * SECOND))

    def run_until_ns(self, time_ns: int, done: Callable[[], bool] = lambda: False) -> bool:
        """Whether `done` came true; lets time pass until then, or until `time_ns` on the clock.

        What is due at `time_ns` itself is left to the next call: a test may still change it.
        """
        if self.real_time and not self._begun:
            self._begin()
        while not done():
            due = min(self._tasks[0].due if self._tasks else time_ns, time_ns)
            self._line.advance(due, self._receive, bool(self._watchers), done)
            if done():
                return True
            if not self._tasks or self._tasks[0].due >= time_ns:
                return False
            self._call(heapq.heappop(self._tasks))
        return True

    def _begin(self) -> None:
        """Count the time of everything scheduled so far from now on: making it took its time."""
        self._begun = True
        if self._tasks:
            late = max(0, self._line.now_ns() - self._tasks[0].due)
            for task in self._tasks:
                task.due += late

    def _call(self, task: _Task) -> None:
        """Run a task. In real time, calls that are a whole period late are skipped, as in a loop."""
        late = self._line.now_ns() - task.due
        if self.real_time and late > 0:
            self.lateness = max(self.lateness, late / SECOND)
            missed = late // task.period
            task.number, task.due = task.number + missed, task.due + missed * task.period
        if task.tick(task.number, task.due):
            task.number, task.due = task.number + 1, task.due + task.period
            heapq.heappush(self._tasks, task)

    def _receive(self, message: can.Message, time_ns: int) -> None:
        if message.is_error_frame:
            self.traffic.errors += 1
            return
        flags = (
            (EXTENDED if message.is_extended_id else 0)
            | (FD if message.is_fd else 0)
            | (BIT_RATE_SWITCH if message.bitrate_switch else 0)
            | (REMOTE if message.is_remote_frame else 0)
        )
        frame = TrafficFrame(time_ns, message.arbitration_id, flags, bytes(message.data))
        if not message.is_remote_frame:
            self.traffic.add(frame, message.is_extended_id)
            for watcher in tuple(self._watchers):
                watcher(frame)

    def signal(self, name: str) -> SignalOf:
        """The signal "Message.signal", shown in plots from now on. Raises InputError."""
        if name not in self.watched:
            self.watched[name] = find_signal(self.database, name)
        return self.watched[name]

    def condition(self, text: str) -> Condition:
        """A condition such as "EngineStatus.engine_speed > 9000 rpm". Raises InputError."""
        made = condition(self.database, text)
        self.watched.setdefault(made.of.name, made.of)
        return made

    def value(self, name: str, unit: str | None = None) -> float:
        """Last value of a signal. Raises InputError where no frame has carried it yet."""
        of = self.signal(name)
        last = self.traffic.last(of)
        if last is None:
            raise InputError(
                f"no frame has carried {name} yet",
                found=f"{len(self.traffic.frames)} frames in {self.now:g} s",
                remedy="let time pass first, or wait for the signal: bus.wait_for",
            )
        return converted(of, last[1], unit)

    def trace(
        self, name: str, since: float = 0.0, unit: str | None = None
    ) -> tuple[Floats, Floats]:
        """Times (s) and values of a signal from `since` (s) on, shape (n,) each."""
        of = self.signal(name)
        times, values = self.traffic.trace(of, since)
        if unit is not None:
            values = values * (converted(of, 1.0, unit) - converted(of, 0.0, unit))
            values = values + converted(of, 0.0, unit)
        return times, values

    def times(self, message: str) -> Floats:
        """Times of the frames of a message, s, shape (n,)."""
        return self.traffic.times(find_message(self.database, message))

    def faults(self, message: str, timeout: float | str = "1 s") -> list[tuple[float, str]]:
        """Time (s) and fault of each faulty frame of a message: wrong CRC, repeated, lost, stale.

        timeout  s between two frames after which the second one is stale
        """
        return self.traffic.faults(find_message(self.database, message), seconds(timeout))

    def wait_for(self, text: str, within: float | str) -> float:
        """Time (s) of the first frame from now on for which a condition holds.

        Time stops right there on the simulated clock. within: s. Raises SignalTimeoutError otherwise.
        """
        __tracebackhide__ = True
        requested, begin = self.condition(text), self.now
        found: list[float] = []
        key = (requested.of.message.identifier, bool(requested.of.message.extended))

        def look(frame: TrafficFrame) -> None:
            if not found and (frame.identifier, bool(frame.flags & EXTENDED)) == key:
                value = requested.of.value(frame.data)
                if value is not None and requested.holds(value):
                    found.append(self.traffic.seconds(frame))

        self.watch(look)
        try:
            latest = self._line.now_ns() + round(seconds(within) * SECOND)
            self.run_until_ns(latest, lambda: bool(found))
        finally:
            self.unwatch(look)
        if not found:
            raise SignalTimeoutError(self._why(requested, begin))
        return found[0]

    def _why(self, requested: Condition, begin: float) -> str:
        times, values = self.traffic.trace(requested.of, begin)
        waited = f"{requested.text} did not occur from {begin:.4f} s to {self.now:.4f} s"
        if not times.size:
            number = int((self.traffic.times(requested.of.message) >= begin).sum())
            name = requested.of.message.name
            if number:
                return f"{waited}: none of {number} frames of {name} held a valid value"
            return f"{waited}: no frame of {name} arrived"
        unit = f" {requested.of.signal.unit}" if requested.of.signal.unit else ""
        return (
            f"{waited}: {times.size} frames, values {values.min():g} to {values.max():g}{unit},"
            f" last {values[-1]:g}{unit} at {times[-1]:.4f} s"
        )

    def close(self) -> None:
        """Leave the bus."""
        self._tasks.clear()
        self._line.close()

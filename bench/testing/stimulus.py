"""Stimulus: what a test does to the bus, at once, after a time, or when a signal does something.

    stimulus.when("EngineStatus.engine_speed > 9000 rpm").drop("EngineStatus", "30 ms")

Faults are those of `bench/bus/faults.py`; this file only gives them a time and a message.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from math import inf

from slipbench.bench.bus.faults import (
    ALL_NODES,
    Corrupted,
    Delayed,
    Disturbed,
    Duplicated,
    Fault,
    FaultPlan,
    Frozen,
    Lost,
    Reordered,
    Where,
)
from slipbench.bench.loop.clock import SECOND
from slipbench.bench.loop.ring import EXTENDED
from slipbench.bench.testing.bench_bus import BenchBus
from slipbench.bench.testing.conditions import Condition, find_message, seconds
from slipbench.bench.testing.cyclic import Content, Cyclic, Value, send
from slipbench.bench.testing.traffic import TrafficFrame
from slipbench.protocol.errors import InputError

Time = float | str
RECENT = 0.2  # s, in which another node must not have sent a message that a test begins to send


class Actions:
    """Faults and calls that begin when `at` calls them; times are s or texts such as "30 ms"."""

    def __init__(self, stimulus: "Stimulus", at: Callable[[Callable[[float], None]], None]) -> None:
        """Begin each action when `at` calls it, with the time of the bus (s)."""
        self._stimulus, self._at = stimulus, at

    def call(self, action: Callable[[], object]) -> "Actions":
        """Call `action` then."""

        def at(_now: float) -> None:
            action()

        self._at(at)
        return self

    def drop(self, message: str, duration: Time, chance: float = 1.0, to: str = "") -> "Actions":
        """Lose the frames of a message for `duration`. to: node that does not get them; "": all."""
        return self._fault(lambda where: Lost(chance, where), message, duration, to, "lost")

    def delay(
        self, message: str, duration: Time, by: Time, spread: Time = 0.0, to: str = ""
    ) -> "Actions":
        """Deliver the frames of a message late for `duration`: by `by` s and up to `spread` s more."""
        late, more = seconds(by), seconds(spread)
        made = lambda where: Delayed(1.0, late, more, where)  # noqa: E731
        return self._fault(made, message, duration, to, "delayed")

    def corrupt(self, message: str, duration: Time, chance: float = 1.0, to: str = "") -> "Actions":
        """Invert one bit of the frames of a message for `duration`, after the CRC check of CAN."""
        return self._fault(lambda where: Corrupted(chance, where), message, duration, to, "corrupt")

    def freeze(self, message: str, duration: Time, to: str = "") -> "Actions":
        """Repeat one payload of a message for `duration`: values, counter and CRC stand still."""
        return self._fault(Frozen, message, duration, to, "frozen")

    def duplicate(
        self, message: str, duration: Time, chance: float = 1.0, to: str = ""
    ) -> "Actions":
        """Deliver the frames of a message twice for `duration`."""
        made = lambda where: Duplicated(chance, where)  # noqa: E731
        return self._fault(made, message, duration, to, "twice")

    def reorder(self, message: str, duration: Time, at_most: Time = "10 ms") -> "Actions":
        """Deliver the next frame before those of a message for `duration`."""
        longest = seconds(at_most)
        made = lambda where: Reordered(1.0, longest, where)  # noqa: E731
        return self._fault(made, message, duration, "", "reordered")

    def disturb(self, message: str, duration: Time, chance: float = 1.0) -> "Actions":
        """Destroy frames of a message on the wire for `duration`: error frames, then bus-off."""
        return self._fault(lambda where: Disturbed(chance, where), message, duration, "", "error")

    def _fault(
        self, made: Callable[[Where], Fault], message: str, duration: Time, to: str, what: str
    ) -> "Actions":
        length = inf if duration == inf else seconds(duration)
        identifier = find_message(self._stimulus.bus.database, message).identifier
        receivers = frozenset({to}) if to else ALL_NODES

        def begin(now: float) -> None:
            where = Where(now, now + length, frozenset({identifier}), ALL_NODES, receivers)
            self._stimulus.inject(made(where), f"{message} {what}")

        self._at(begin)
        return self


class Stimulus(Actions):
    """Actions of a test on its bus. The actions of this object itself begin at once."""

    def __init__(self, bus: BenchBus, seed: int = 0) -> None:
        """Act on `bus`. seed: of faults that occur by chance."""
        super().__init__(self, lambda action: action(bus.now))
        self.bus, self._seed = bus, seed
        self._faults: list[Fault] = []
        self._node = bus.node("stimulus")
        self._sent: dict[str, Content] = {}
        self._pending: list[tuple[Condition, list[float]]] = []
        self._waiting: list[str] = []

    # Messages

    def send(self, message: str, **values: Value) -> None:
        """Send a message once, with the next counter. Raises InputError where the bus refuses it.

        A value is a number in the database's unit, or a text such as "20 %".
        """
        if not send(self._node, self._content(message, values)):
            raise InputError(
                f"the bus refused {message}",
                found=str(self._node.state),
                remedy="check that the bus runs and another node acknowledges",
            )

    def cyclic(self, message: str, period: Time | None = None, **values: Value) -> Cyclic:
        """Send a message every cycle from now on. period: s; None: the cycle time of the database.

        Raises InputError where another node sends the message, or no cycle time is known.
        """
        content = self._content(message, values)
        cycle = content.message.cycle_time if period is None else seconds(period)
        if cycle is None or cycle <= 0:
            raise InputError(
                f"the cycle time of {message} is not known",
                where=self.bus.database.origin,
                remedy="give it: period = 0.010, or GenMsgCycleTime in the database",
            )
        return Cyclic(self.bus, self._node, content, cycle)

    def _content(self, name: str, values: dict[str, Value]) -> Content:
        message = find_message(self.bus.database, name)
        if name not in self._sent:
            frames = self.bus.traffic.of(message)
            if frames and self.bus.now - self.bus.traffic.seconds(frames[-1]) < RECENT:
                raise InputError(
                    f"another node sends {name}",
                    expected="one sender of each message",
                    found=f"its last frame at {self.bus.traffic.seconds(frames[-1]):.4f} s",
                    remedy="leave that node out, or change its frames: stimulus.drop, replay edits",
                )
            self._sent[name] = Content(self.bus, message, values)
        else:
            self._sent[name].set(**values)
        return self._sent[name]

    # Time

    def wait(self, duration: Time) -> None:
        """Let time pass."""
        self.bus.run(duration)

    def wait_for(self, text: str, within: Time) -> float:
        """Time (s) of the first frame from now on for which a condition holds. Raises SignalTimeoutError."""
        __tracebackhide__ = True
        return self.bus.wait_for(text, within)

    def after(self, delay: Time) -> Actions:
        """Actions that begin `delay` after now. Raises InputError for what is no duration."""
        wait = round(seconds(delay) * SECOND)
        due_ns, bus = self.bus.line.now_ns() + wait, self.bus
        text = f"after {seconds(delay):g} s from {bus.now:.4f} s"

        def at(action: Callable[[float], None]) -> None:
            def once(number: int, due: int) -> bool:
                self._waiting.remove(text)
                action((due - bus.traffic.origin_ns) / SECOND)
                return False

            self._waiting.append(text)
            bus.schedule(SECOND, once, due_ns - bus.line.now_ns())

        return Actions(self, at)

    def when(self, text: str, every_time: bool = False, optional: bool = False) -> Actions:
        """Actions that begin with the first frame for which a condition holds.

        every_time  begin again whenever the condition holds after it did not
        optional    the test passes also where the condition never held

        The bus may carry simulated, real or replayed frames. Raises InputError for another text.
        """
        condition = self.bus.condition(text)
        actions: list[Callable[[float], None]] = []
        last: list[float] = []
        if not optional:
            self._pending.append((condition, last))
        held = False
        key = (condition.of.message.identifier, bool(condition.of.message.extended))

        def look(frame: TrafficFrame) -> None:
            nonlocal held
            if (frame.identifier, bool(frame.flags & EXTENDED)) != key:
                return
            value = condition.of.value(frame.data)
            if value is None:
                return
            last[:] = [value]
            before, held = held, condition.holds(value)
            if not held or before:
                return
            self._fired(condition)
            for action in tuple(actions):
                action(self.bus.traffic.seconds(frame))
            if not every_time:
                self.bus.unwatch(look)

        self.bus.watch(look)
        return Actions(self, actions.append)

    def _fired(self, condition: Condition) -> None:
        self.bus.marks.append((self.bus.now, self.bus.now, condition.text))
        self._pending = [each for each in self._pending if each[0] is not condition]

    def never_occurred(self) -> list[str]:
        """What never began: conditions that never held, with their last value, and times to come."""
        later = [
            f"{text}: the test ended before, so its stimulus never began" for text in self._waiting
        ]
        return later + [
            f"{condition.text} never occurred, so its stimulus never began; "
            + (
                f"last value {last[0]:g} {condition.of.signal.unit}".rstrip()
                if last
                else "no frame"
            )
            for condition, last in self._pending
        ]

    # Faults

    def inject(self, fault: Fault, text: str = "") -> None:
        """Apply a fault of `bench/bus/faults.py`; its times count from the begin of the bus (s).

        Raises InputError where it could have no effect on this bus.
        """
        faults = [*self._faults, fault]
        self.bus.line.set_faults(faults, self.bus.traffic.origin_ns, self._seed)
        self._faults = faults
        name = text or type(fault).__name__.lower()
        self.bus.marks.append((fault.where.begin, fault.where.end, name))

    def inject_plan(self, plan: FaultPlan) -> None:
        """Apply a fault plan, whose times count from now; its seed is that of all faults."""
        self._seed = plan.seed
        for fault in _later(plan.faults, self.bus.now):
            self.inject(fault)


def _later(faults: Iterable[Fault], by: float) -> Sequence[Fault]:
    moved = []
    for fault in faults:
        end = fault.where.end if fault.where.end == inf else fault.where.end + by
        where = replace(fault.where, begin=fault.where.begin + by, end=end)
        moved.append(replace(fault, where=where))
    return moved

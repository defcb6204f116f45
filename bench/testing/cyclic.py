"""Messages that a test sends: once or every cycle, with counter and CRC."""

import can

from slipbench.bench.bus.frame_content import physical, protect, raw_of, value_in, with_raw
from slipbench.bench.loop.clock import SECOND
from slipbench.bench.testing.bench_bus import BenchBus
from slipbench.bench.testing.conditions import SignalOf, find_signal, in_unit, seconds
from slipbench.protocol.codec import e2e
from slipbench.protocol.codec.messages import WRAPPING
from slipbench.protocol.database.layout import Message, Signal
from slipbench.protocol.errors import InputError
from slipbench.protocol.units import linear

Value = float | str
OWN = ("crc", "counter")  # written by the protection


class Content:
    """Values of a message; each payload has the next counter and its CRC.

    A signal that is not given has its start value. A clock, that is a wrapping signal named "time",
    is the time of the bus.
    """

    def __init__(self, bus: BenchBus, message: Message, values: dict[str, Value]) -> None:
        """Take the values. Raises InputError for an unknown signal or a value that does not fit."""
        self._bus, self.message = bus, message
        self._base = bytes(message.length)
        self._counter = 0
        self._clock = message.by_name.get("time")
        if self._clock is not None and ("time" in values or not _is_clock(self._clock)):
            self._clock = None
        for signal in message.signals:
            if signal.start_value and signal.multiplexer is None:
                self._base = with_raw(signal, self._base, signal.start_value)
        self.set(**values)

    def signal(self, name: str) -> SignalOf:
        """A signal of this message. Raises InputError where there is none, or it is computed."""
        if name in OWN and self.message.protection is not None:
            raise InputError(
                f"{self.message.name}.{name} is computed from the other signals",
                remedy="to send a wrong one, inject a fault: stimulus.corrupt, stimulus.freeze",
            )
        return find_signal(self._bus.database, f"{self.message.name}.{name}")

    def set(self, **values: Value) -> None:
        """Change signals. Raises InputError for an unknown signal or a value that does not fit."""
        data = self._base
        for name, value in values.items():
            of = self.signal(name)
            try:
                data = with_raw(of.signal, data, _raw(of, in_unit(of, value)))
            except ValueError as cause:
                raise InputError(
                    f"{of.name} cannot carry {value!r}",
                    found=str(cause),
                    expected="a value that the database allows",
                ) from cause
        self._base = data

    def value(self, name: str) -> float:
        """Present value of a signal, in the database's unit."""
        of = self.signal(name)
        found = value_in(self.message, of.signal, self._base)  # its CRC is not computed yet
        return 0.0 if found is None else found

    def payload(self) -> bytes:
        """The next payload."""
        data = self._base
        if self._clock is not None:
            slope, offset = linear("s", self._clock.unit)
            raw = raw_of_clock(self._clock, slope * self._bus.now + offset)
            data = with_raw(self._clock, data, raw)
        counter, self._counter = self._counter, (self._counter + 1) % e2e.PERIOD
        return protect(self.message, data, counter)


class Cyclic:
    """A message that is sent every `period`, until it is stopped."""

    def __init__(self, bus: BenchBus, node: can.BusABC, content: Content, period: float) -> None:
        """Send `content` on `node` from now on. period: s."""
        self._bus, self._node, self._content = bus, node, content
        self._period = round(period * SECOND)
        self._silent_until = -1.0  # s
        self._ramp: tuple[str, float, float, float, float] | None = None
        self._running = self._scheduled = False
        self.refused = 0  # number of frames that the bus refused
        self.start()

    @property
    def message(self) -> Message:
        """The message that is sent."""
        return self._content.message

    def set(self, **values: Value) -> None:
        """Change signals from the next frame on; a ramp of one of them ends. Raises InputError."""
        self._content.set(**values)
        if self._ramp is not None and self._ramp[0] in values:
            self._ramp = None

    def ramp(self, signal: str, to: Value, over: float | str) -> None:
        """Move a signal linearly from its present value to `to` within `over` (s). Raises InputError."""
        of = self._content.signal(signal)
        target = in_unit(of, to)
        _raw(of, target)
        now = self._bus.now
        self._ramp = (signal, self._content.value(signal), target, now, now + seconds(over))

    def pause(self, duration: float | str) -> None:
        """Send nothing for this time (s); the counter goes on where it stopped."""
        self._silent_until = self._bus.now + seconds(duration)

    def stop(self) -> None:
        """Send no more."""
        self._running = False

    def start(self) -> None:
        """Send again after `stop`."""
        self._running = True
        if not self._scheduled:
            self._scheduled = True
            self._bus.schedule(self._period, self._send)

    def _send(self, number: int, due: int) -> bool:
        if not self._running:
            self._scheduled = False
            return False
        now = self._bus.now
        if self._ramp is not None:
            signal, begin, end, since, until = self._ramp
            share = 1.0 if until <= since else min(1.0, (now - since) / (until - since))
            self._content.set(**{signal: begin + share * (end - begin)})
            self._ramp = None if share >= 1.0 else self._ramp
        if now >= self._silent_until - 1e-9:
            self.refused += not send(self._node, self._content)
        return True


def send(node: can.BusABC, content: Content) -> bool:
    """Whether the bus took the next frame of `content`."""
    message = content.message
    frame = can.Message(
        arbitration_id=message.identifier,
        data=content.payload(),
        is_extended_id=message.extended,
        is_fd=message.fd,
    )
    try:
        node.send(frame)
    except can.CanOperationError:
        return False
    return True


def raw_of_clock(signal: Signal, value: float) -> int:
    """Raw value of a clock, modulo its width. value: in the database's unit."""
    return round((value - signal.offset) / signal.scale) % (1 << signal.length)


def _is_clock(signal: Signal) -> bool:
    if not (signal.wraps or signal.name in WRAPPING):
        return False
    try:
        linear("s", signal.unit)
    except ValueError:
        return False
    return not signal.is_float


def _raw(of: SignalOf, value: float) -> int | float:
    """Raw value. Raises ValueError where the width or the range of the database forbids it."""
    signal = of.signal
    raw = raw_of(signal, value)
    half = abs(float(signal.scale)) / 2
    low = signal.minimum if signal.minimum is not None else -float("inf")
    high = signal.maximum if signal.maximum is not None else float("inf")
    if not signal.wraps and not low - half <= physical(signal, raw) <= high + half:
        raise ValueError(f"{signal.name} = {value:g} is not in {low:g} to {high:g} {signal.unit}")
    return raw

"""Conditions on signals as text: "EngineStatus.engine_speed > 9000 rpm"."""

import difflib
import operator
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import inf

from slipbench.bench.bus.frame_content import crc_correct, value_in
from slipbench.protocol.database.layout import Database, Message, Signal
from slipbench.protocol.errors import InputError
from slipbench.protocol.units import linear, parse_quantity

OPERATORS: dict[str, Callable[[float, float], bool]] = {
    ">=": operator.ge,
    "<=": operator.le,
    "==": operator.eq,
    "!=": operator.ne,
    ">": operator.gt,
    "<": operator.lt,
}
FORM = re.compile(r"\s*(\w+\.\w+)\s*(>=|<=|==|!=|>|<)\s*(.+?)\s*")


@dataclass(frozen=True)
class SignalOf:
    """A signal and the message that carries it."""

    message: Message
    signal: Signal

    @property
    def name(self) -> str:
        """The name "Message.signal"."""
        return f"{self.message.name}.{self.signal.name}"

    def value(self, data: bytes) -> float | None:
        """Physical value in a frame, in the database's unit.

        None where the frame holds none, or where its CRC is wrong: no receiver takes such a value.
        """
        if not crc_correct(self.message, data):
            return None
        return value_in(self.message, self.signal, data)


@dataclass(frozen=True)
class Condition:
    """A comparison of a signal with a number in the database's unit."""

    of: SignalOf
    compare: str
    limit: float
    text: str

    def holds(self, value: float) -> bool:
        """Whether the condition holds for a value in the database's unit.

        Values are compared at half a raw step: 9000.0000001 rpm is 9000 rpm on the bus.
        """
        step = 0.0 if self.of.signal.is_float else abs(float(self.of.signal.scale)) / 2
        near = abs(value - self.limit) < step
        if near:
            return self.compare in ("==", ">=", "<=")
        return OPERATORS[self.compare](value, self.limit)


def seconds(time: float | str) -> float:
    """A duration in s, from s or from a text such as "30 ms".

    Raises InputError for other texts, and for what is no duration.
    """
    duration = parse_quantity(time, "s")
    if not 0 <= duration < inf:
        raise InputError(
            "this is no duration", expected='0 s or more, as in 0.03 or "30 ms"', found=str(time)
        )
    return duration


def find_message(database: Database, name: str) -> Message:
    """Message of this name. Raises InputError with the nearest names where there is none."""
    if name in database.by_name:
        return database.by_name[name]
    raise _unknown(f"the database has no message {name!r}", database.origin, name, database.by_name)


def find_signal(database: Database, name: str) -> SignalOf:
    """Signal "Message.signal". Raises InputError with the nearest names where there is none."""
    message_name, _, signal_name = name.partition(".")
    message = find_message(database, message_name)
    if signal_name not in message.by_name:
        what = f"message {message.name} has no signal {signal_name!r}"
        raise _unknown(what, database.origin, signal_name, message.by_name)
    return SignalOf(message, message.by_name[signal_name])


def in_unit(of: SignalOf, value: float | str) -> float:
    """A value in the database's unit, from such a number, a name of the value table, or "20 %".

    Raises InputError where the text is neither a name nor a quantity of that unit.
    """
    if not isinstance(value, str):
        return float(value)
    for raw, choice in of.signal.choices.items():
        if choice == value:
            return raw * of.signal.scale + of.signal.offset
    text = value if " " in value.strip() else f"{value} {of.signal.unit}"
    try:
        return parse_quantity(text, of.signal.unit)
    except InputError as fault:
        raise InputError(
            f"{value!r} is no value of {of.name}",
            expected=", ".join(of.signal.choices.values()) or f"a number in {of.signal.unit or 1}",
            found=fault.found,
            remedy='write it as in "9000 rpm"',
        ) from fault


def condition(database: Database, text: str) -> Condition:
    """Condition of a text. Raises InputError where it is not "Message.signal > number unit"."""
    match = FORM.fullmatch(text)
    if match is None:
        raise InputError(
            f"{text!r} is not a condition",
            expected='"Message.signal", one of > >= < <= == !=, a number and its unit',
            remedy='write it as in "EngineStatus.engine_speed > 9000 rpm"',
        )
    name, compare, limit = match.groups()
    of = find_signal(database, name)
    return Condition(of, compare, in_unit(of, limit), text.strip())


def converted(of: SignalOf, value: float, unit: str | None) -> float:
    """A value in another unit; None: in the database's. Raises InputError where it does not convert."""
    if unit is None:
        return value
    try:
        slope, offset = linear(of.signal.unit, unit)
    except ValueError as cause:
        raise InputError(
            f"{of.name} cannot be given in {unit!r}",
            expected=f"a unit that {of.signal.unit or 1} converts to",
            found=str(cause),
        ) from cause
    return slope * value + offset


def nearest(name: str, known: Iterable[str]) -> str:
    """Remedy for a name that is not known: the nearest names, or to check the spelling."""
    near = difflib.get_close_matches(name, list(known), 3, 0.5)
    return f"did you mean {' or '.join(near)}?" if near else "check the spelling"


def _unknown(what: str, where: str, name: str, known: Iterable[str]) -> InputError:
    names = list(known)
    expected = "one of " + ", ".join(names)
    return InputError(what, where=where, expected=expected, found=name, remedy=nearest(name, names))

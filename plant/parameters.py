"""A physical parameter is a number with a unit, a meaning and a range; a block is a set of them."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import Field, dataclass, field, fields
from typing import Any

from slipbench.plant.errors import ParameterError, nearest


@dataclass(frozen=True)
class Parameter:
    """Description of a parameter, without its value. All figures are SI."""

    name: str
    unit: str
    text: str
    low: float
    high: float
    typical: float
    absent: float
    whole: bool
    smallest: float | None = None
    sought: tuple[float, ...] = ()
    given: bool = False

    @property
    def sized(self) -> bool:
        """Whether this parameter is a size of its effect, rather than its shape."""
        return self.smallest is not None


def evenly(first: float, last: float, step: float) -> tuple[float, ...]:
    """Values from the first one to below the last one."""
    return tuple(first + step * n for n in range(math.ceil((last - first) / step)))


def parameter(
    typical: float,
    unit: str,
    low: float,
    high: float,
    text: str,
    *,
    absent: float | None = None,
    smallest: float | None = None,
    whole: bool = False,
    sought: tuple[float, ...] = (),
    given: bool = False,
) -> float:
    """Declare a field of a Block: default, SI unit, valid range (inclusive) and meaning.

    absent: the value at which the effect that owns the parameter vanishes; a parameter that only
    shapes an effect has none and keeps its typical value.
    smallest: of a parameter that sizes an effect, the least size that anybody would care for; it
    lies between absent and typical.
    sought: of a place that no recording comes near to by chance, on the road, along a speed, or a
    period: the values at which an effect is looked for, in ascending order, at least two.
    given: whether no recording determines it beside the size, because only both together act.
    """
    metadata = {
        "unit": unit,
        "text": text,
        "low": low,
        "high": high,
        "typical": typical,
        "absent": typical if absent is None else absent,
        "whole": whole,
        "smallest": smallest,
        "sought": sought,
        "given": given,
    }
    return field(default=typical, metadata=metadata)


def word(default: str, text: str, choices: tuple[str, ...] = ()) -> str:
    """Declare a field that is a word: a channel, a clock, a wheel; one of choices if given."""
    return field(default=default, metadata={"word": text, "choices": choices})


def _described(entry: Field[Any]) -> Parameter:
    return Parameter(name=entry.name, **entry.metadata)


@dataclass(frozen=True)
class Block:
    """One part of the motorcycle: frozen, in SI, every value checked against its range."""

    @classmethod
    def parameters(cls) -> tuple[Parameter, ...]:
        """The description of every parameter, in the order of the fields."""
        return _parameters(cls)

    @classmethod
    def words(cls) -> Mapping[str, tuple[str, ...]]:
        """The fields that are words, with the choices of each; none: any word."""
        return {f.name: f.metadata["choices"] for f in fields(cls) if "word" in f.metadata}

    def values(self) -> Iterator[float]:
        """Yield the values, in the order of `parameters`."""
        return (float(getattr(self, p.name)) for p in self.parameters())

    def __post_init__(self) -> None:
        for described in self.parameters():
            check(described, getattr(self, described.name), type(self).__name__)
        for name, choices in self.words().items():
            check_word(getattr(self, name), choices, f"{type(self).__name__}.{name}")


_KNOWN: dict[type[Block], tuple[Parameter, ...]] = {}


def _parameters(block: type[Block]) -> tuple[Parameter, ...]:
    """The descriptions, gathered once a class: fits make very many blocks."""
    if block not in _KNOWN:
        _KNOWN[block] = tuple(_described(f) for f in fields(block) if "unit" in f.metadata)
    return _KNOWN[block]


def check(described: Parameter, value: object, owner: str) -> None:
    """Raise ParameterError unless the value is a number inside the parameter's range."""
    numeric = isinstance(value, (int, float)) and not isinstance(value, bool)
    number = value if isinstance(value, (int, float)) else math.nan
    inside = described.low <= number <= described.high or number == described.absent
    if numeric and inside and not (described.whole and number != math.floor(number)):
        return
    kind = "a whole number" if described.whole else "a number"
    raise ParameterError(
        what=f"{described.text} is outside its range",
        where=f"{owner}.{described.name}",
        expected=f"{kind} from {described.low:g} to {described.high:g} {described.unit}",
        found=f"{value!r}",
        remedy="correct the value or its unit",
    )


def check_word(value: str, choices: tuple[str, ...], where: str) -> None:
    """Raise ParameterError unless the word is one of the choices; no choices allow any word."""
    if value in choices or (not choices and value):
        return
    expected = f"one of {', '.join(choices)}" if choices else "a word"
    raise ParameterError("unknown word", where, expected, repr(value), nearest(value, choices))

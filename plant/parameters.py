"""A physical parameter is a number with a unit, a meaning and a range; a block is a set of them."""

import math
from collections.abc import Iterator
from dataclasses import Field, dataclass, field, fields
from typing import Any

from plant.trouble import ParameterError


@dataclass(frozen=True)
class Parameter:
    """What is known of a parameter before anyone gives it a value. All figures are SI."""

    name: str
    unit: str
    text: str
    low: float
    high: float
    typical: float
    absent: float
    whole: bool


def parameter(
    typical: float,
    unit: str,
    low: float,
    high: float,
    text: str,
    *,
    absent: float | None = None,
    whole: bool = False,
) -> float:
    """Declare a field of a Block: default, SI unit, valid range (inclusive) and meaning.

    absent: the value at which the effect that owns the parameter vanishes; a parameter that only
    shapes an effect has none and keeps its typical value.
    """
    metadata = {
        "unit": unit,
        "text": text,
        "low": low,
        "high": high,
        "typical": typical,
        "absent": typical if absent is None else absent,
        "whole": whole,
    }
    return field(default=typical, metadata=metadata)


def _described(entry: Field[Any]) -> Parameter:
    return Parameter(name=entry.name, **entry.metadata)


@dataclass(frozen=True)
class Block:
    """One part of the motorcycle: frozen, in SI, every value checked against its range."""

    @classmethod
    def parameters(cls) -> tuple[Parameter, ...]:
        """Return the description of every parameter, in the order of the fields."""
        return _parameters(cls)

    def values(self) -> Iterator[float]:
        """Yield the values, in the order of `parameters`."""
        return (float(getattr(self, p.name)) for p in self.parameters())

    def __post_init__(self) -> None:
        for described in self.parameters():
            check(described, getattr(self, described.name), type(self).__name__)


_KNOWN: dict[type[Block], tuple[Parameter, ...]] = {}


def _parameters(block: type[Block]) -> tuple[Parameter, ...]:
    """Return the descriptions, gathered once a class: fits make very many blocks."""
    if block not in _KNOWN:
        _KNOWN[block] = tuple(_described(f) for f in fields(block) if "unit" in f.metadata)
    return _KNOWN[block]


def check(described: Parameter, value: object, owner: str) -> None:
    """Raise ParameterError unless the value is a number inside the parameter's range."""
    numeric = isinstance(value, (int, float)) and not isinstance(value, bool)
    number = float(value) if isinstance(value, (int, float)) else math.nan
    whole = not described.whole or number == math.floor(number)
    inside = described.low <= number <= described.high or number == described.absent
    if numeric and inside and whole:
        return
    kind = "a whole number" if described.whole else "a number"
    raise ParameterError(
        what=f"{described.text} is outside its range",
        where=f"{owner}.{described.name}",
        expected=f"{kind} from {described.low:g} to {described.high:g} {described.unit}",
        found=f"{value!r}",
        remedy="correct the value or its unit",
    )

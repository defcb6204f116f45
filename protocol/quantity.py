"""A quantity as a user writes it: a number and a unit; with hard bounds and their reason."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import GetCoreSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, core_schema

from slipbench.protocol.unit_spellings import spelled
from slipbench.protocol.units import linear, number_and_unit

# The units that each quantity may be written in, by its SI unit. The list is closed: a unit library
# takes a degree for 0.017 of a ratio and a revolution per minute for 0.1 Hz.
UNITS = {
    "": ("%",),
    "1/s": ("%/s",),
    "s": ("s", "ms", "us", "min"),
    "Hz": ("Hz", "mHz", "kHz"),
    "m": ("m", "mm", "cm", "km"),
    "m/s": ("m/s", "km/h", "mph"),
    "rad": ("deg", "rad"),
    "rad/s": ("deg/s", "rad/s"),
    "rpm": ("rpm", "rad/s", "turn/s"),
    "Pa": ("bar", "mbar", "kPa", "MPa", "Pa"),
}
_IN_SI = {"rpm": "rad/s"}
_ROUNDING = 1e-12  # "50 ms" and "0.05 s" differ in their last bit


class Quantity(float):
    """A number in SI that keeps the unit in which it was written; its text is as written."""

    unit: str
    si: str
    text: str

    def __new__(cls, value: float, unit: str, si: str, text: str) -> "Quantity":
        """Keep `value` (in `si`) and `text`, as the user wrote it in `unit`."""
        made = super().__new__(cls, value)
        made.unit, made.si, made.text = unit, si, text
        return made

    def __getnewargs__(self) -> tuple[float, str, str, str]:  # type: ignore[override]
        """Give what a copy in another process is made of."""
        return float(self), self.unit, self.si, self.text

    def __str__(self) -> str:
        """Return the text of the file."""
        return self.text

    def like(self, value: float) -> str:
        """Return `value` (in SI) as text in the unit of this quantity."""
        slope, offset = linear(self.unit, self.si)
        return f"{(value - offset) / slope:.6g} {self.unit}".rstrip()


def shown(value: float, like: float) -> str:
    """Return `value` (SI) as text in the unit in which `like` was written; in SI for a number."""
    return like.like(value) if isinstance(like, Quantity) else f"{value:.6g}"


def read_quantity(text: str, kind: str) -> Quantity:
    """Read a quantity of a `kind` of UNITS, as in "14000 rpm".

    Raises ValueError where the number is not finite, or the unit is missing or is not of that kind.
    """
    units = UNITS[kind]
    number, unit = number_and_unit(text)
    known = unit if unit in units else spelled(unit)
    if known not in units:
        what = f"the unit {unit!r} is not one for this quantity" if unit else "the unit is missing"
        raise ValueError(f"{what}; write a number and one of: {', '.join(units)}")
    try:
        magnitude = float(number)
    except ValueError:
        raise ValueError(f"{number!r} is not a number; write it as in {_example(kind)}") from None
    si = _IN_SI.get(kind, kind)
    slope, offset = linear(known, si)
    value = slope * magnitude + offset
    if not math.isfinite(value):
        raise ValueError("a finite number is expected")
    return Quantity(value, known, si, text.strip())


def _example(kind: str) -> str:
    return f'"2 {UNITS[kind][0]}"'


@dataclass(frozen=True)
class Between:
    """Annotation of a field: a quantity of a `kind` of UNITS from `low` to `high`, and why.

    The validation context {"recorded": True} accepts what older recordings hold: numbers in SI, and
    values beyond the bounds, which are of no danger any more.
    """

    kind: str
    low: str
    high: str
    reason: str

    def bounds(self) -> tuple[Quantity, Quantity]:
        """Return the lowest and the highest value that is accepted, SI."""
        return read_quantity(self.low, self.kind), read_quantity(self.high, self.kind)

    def validate(self, value: Any, info: ValidationInfo) -> Quantity:
        """Return the quantity in SI. Raises ValueError with the bound and its reason."""
        recorded = of_recording(info)
        low, high = self.bounds()
        if isinstance(value, str):
            read = read_quantity(value, self.kind)
        elif isinstance(value, Quantity):
            read = value
        elif recorded and isinstance(value, int | float) and math.isfinite(value):
            read = Quantity(value, low.si, low.si, f"{value:g} {low.si}".rstrip())
        else:
            raise ValueError(
                f'the unit is missing; write it as in "{self.high}"'
                f" (allowed: {self.low} to {self.high})"
            )
        slack = _ROUNDING * max(abs(low), abs(high))
        if not recorded and not low - slack <= read <= high + slack:
            raise ValueError(
                f"not within {read.like(low)} to {read.like(high)}, because {self.reason}"
            )
        return read

    def __get_pydantic_core_schema__(
        self, _source: Any, _handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Tell pydantic to validate with this."""
        return core_schema.with_info_plain_validator_function(
            self.validate, serialization=core_schema.plain_serializer_function_ser_schema(float)
        )


@dataclass(frozen=True)
class BetweenBy:
    """Annotation of a field whose bounds depend on the value of an earlier key of its table.

    key     the earlier key
    bounds  bounds by the value of that key
    """

    key: str
    bounds: Mapping[str, Between]

    def validate(self, value: Any, info: ValidationInfo) -> Quantity:
        """Return the quantity in SI. Raises ValueError with the bound and its reason."""
        if self.key not in info.data:
            raise ValueError(f"{self.key} is needed to check it")
        return self.bounds[info.data[self.key]].validate(value, info)

    def __get_pydantic_core_schema__(
        self, _source: Any, _handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Schema that validates with this."""
        return core_schema.with_info_plain_validator_function(
            self.validate, serialization=core_schema.plain_serializer_function_ser_schema(float)
        )


@dataclass(frozen=True)
class Whole:
    """Annotation of a field: a whole number from `low` to `high`, and why.

    In a recording (see Between) any whole number is accepted.
    """

    low: int
    high: int
    reason: str

    def validate(self, value: Any, handler: Any, info: ValidationInfo) -> int:
        """Return the number. Raises ValueError with the bounds and their reason."""
        if of_recording(info) or (type(value) is int and self.low <= value <= self.high):
            return int(handler(value))
        raise ValueError(
            f"not a whole number from {self.low} to {self.high}, because {self.reason}"
        )

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Schema that validates with this."""
        return core_schema.with_info_wrap_validator_function(self.validate, handler(source))


def of_recording(info: ValidationInfo) -> bool:
    """Whether the file belongs to a recording: its trial is over."""
    return bool(info.context and info.context.get("recorded"))

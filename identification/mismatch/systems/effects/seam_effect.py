"""Base of effects for any seam: one page each, with sizes in the magnitude of the seam.

A page writes its parameters in relative units: `[seam]` is the usual magnitude of the quantity at
which it acts, `[other]` that of the other quantity that it uses, `[time]` the period of the
residual bins; `[1/seam^2]`, `[seam/other]`, `[seam*time^2]` and the like are their powers and
products. `placed` returns the effect at one seam of one system, with physical units and ranges.

`act` is a plain function of floats, compiled into the kernel like the hooks of the plant's effects.
It returns the new value of the quantity; its arguments are identified by name:

value    the quantity at the seam           other   the other quantity that the effect uses
rate_of  at a state's rate: the state, else NaN    step   of integration, s
past     the value a delay ago          elapsed since the last update of the memory, s
memory   the memory at that time; further values: second, third, fourth
and the effect's own parameters and states, whose rates it returns after the value. An effect that
`remembers` returns the new memory instead; the initial memory is the value itself or that of
`starts`. An effect that `gives` returns the rate that the state named by the model file gains.
Inputs may jump where a row of the simulation begins: the memory is updated with zero elapsed time.
"""

import dataclasses
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from slipbench.identification.mismatch.simulation.written_units import power_of
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats

RELATIVE = re.compile(r"\[(1/)?(seam|other|time)(?:\^(\d))?\]")
PRODUCT = re.compile(r"\[(seam|other)([*/])(other|time)(?:\^(\d))?\]")
INPUT, SEAM, RATE, OUTPUT = "input", "seam", "rate", "output"


@dataclass(frozen=True)
class Place:
    """A quantity of a system. kind: input, seam, rate or output; size: its usual magnitude.

    other: name of another quantity that the effect may use, with its unit and size. other_unseen:
    it is an unmeasured angle, of which only the speed is recorded.
    """

    name: str
    kind: str
    unit: str
    size: float
    other: str = ""
    other_unit: str = "1"
    other_size: float = 1.0
    other_unseen: bool = False


@dataclass(frozen=True)
class SeamEffect(Effect):
    """Base of all effects of model files.

    acts_on: kinds of places. uses: the other quantity that it needs (placing.py): "along", the
    speed of a seam; "channel", every other input; "angle", every other input in rad; "turn", every
    other input or state that is a rotation angle; "speed", every state that is a speed; "into", a
    state that gains; at a rate: "position", the state with that rate; "of_position", "of_speed"
    and "of_store", no other quantity, but only at a position, a speed, or neither. remembers:
    number of memory values. delay_parameter: name of the parameter that is the delay of `past`.
    variants: factors of the typical value of the parameter `varies`, each a separate candidate.
    """

    acts_on: ClassVar[tuple[str, ...]] = (INPUT, SEAM, OUTPUT)
    uses: ClassVar[str] = ""
    remembers: ClassVar[int] = 0
    delay_parameter: ClassVar[str] = ""
    gives: ClassVar[bool] = False
    variants: ClassVar[tuple[float, ...]] = (1.0,)
    varies: ClassVar[str] = ""
    place: ClassVar[Place]
    act: ClassVar[Callable[..., Any] | None] = None
    shows_in: ClassVar[tuple[str, ...]] = ()
    confused_with: ClassVar[tuple[str, ...]] = ()

    @property
    def subject(self) -> str:
        """Return the place where it acts, and the other quantity that it uses."""
        return f"{self.place.name}/{self.place.other}" if self.place.other else self.place.name

    def late(self, time: Floats) -> Floats | None:
        """Return the delay of an output at these times, s, (n,); None: no delay."""
        return None


_PLACED: dict[tuple[str, Place, float, float], type[SeamEffect]] = {}


def placed(
    kind: type[SeamEffect], place: Place, period: float, factor: float = 1.0
) -> type[SeamEffect]:
    """Return the effect at a place. factor: of the typical value of the parameter `varies`."""
    key = (kind.name, place, period, factor)
    if key not in _PLACED:
        _PLACED[key] = _made(kind, place, period, factor)
    return _PLACED[key]


def _made(kind: type[SeamEffect], place: Place, period: float, factor: float) -> type[SeamEffect]:
    fields = []
    for field in dataclasses.fields(kind):
        described = dict(field.metadata)
        scale, described["unit"] = _scaled(described["unit"], place, period)
        own = factor if field.name == kind.varies else 1.0
        for key in ("low", "high", "absent", "smallest"):
            if described[key] is not None:
                described[key] = scale * described[key]
        described["typical"] = scale * own * described["typical"]
        if described["smallest"] is None:
            described["absent"] = described["typical"]
        default = dataclasses.field(default=described["typical"], metadata=described)
        fields.append((field.name, float, default))
    made = dataclasses.make_dataclass(
        kind.__name__,
        fields,
        bases=(kind,),
        frozen=True,
        namespace={
            "__doc__": kind.__doc__,
            "place": place,
            "block": place.name,
            "unseen_turn": place.other_unseen and kind.uses == "turn",
        },
    )
    made.__module__ = (
        kind.__module__
    )  # where its page is; make_dataclass of Python 3.12 names this file
    return made


def _scaled(unit: str, place: Place, period: float) -> tuple[float, str]:
    """Return size and unit of a relative unit at a place."""
    if match := PRODUCT.fullmatch(unit):
        return _product(match[1], match[2], match[3], int(match[4] or 1), place, period)
    match = RELATIVE.fullmatch(unit)
    if not match:
        return 1.0, unit
    inverse, of, power = match[1], match[2], int(match[3] or 1)
    size, base = _quantity(of, place, period)
    if base == "1":
        return size ** (-power if inverse else power), "1"
    return size ** (-power if inverse else power), power_of(base, power, bool(inverse))


def _quantity(name: str, place: Place, period: float) -> tuple[float, str]:
    """Return size and unit of a quantity that a relative unit names."""
    sizes = {"seam": place.size, "other": place.other_size, "time": period}
    units = {"seam": place.unit, "other": place.other_unit, "time": "s"}
    return sizes[name], units[name]


def _product(
    of: str, sign: str, by: str, power: int, place: Place, period: float
) -> tuple[float, str]:
    """Return size and unit of a product or quotient; seconds cancel: rad/s times s is rad."""
    (size, unit), (factor, base) = _quantity(of, place, period), _quantity(by, place, period)
    if sign == "/":
        divided = "" if base == "1" else power_of(base, 1, inverse=True)[1:] * power
        return size / factor**power, f"{unit}{divided}"
    for _ in range(power):
        cancels = base == "s" and unit.endswith("/s")
        unit = unit.removesuffix("/s") if cancels else f"{unit}*{base}"
    return size * factor**power, unit

"""Where the fields of the bench's messages lie on a bus: in which message, in which signal."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields

from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    BenchMessage,
    ChassisStatus,
    EcuStatus,
    EncoderStatus,
    EngineStatus,
    OpticalSpeed,
    RiderControls,
    Temperatures,
    ThrottleStatus,
    ToothIntervals,
    TrialStatus,
    WheelSpeed,
)
from slipbench.protocol.database.layout import Database

MESSAGES: dict[str, type[BenchMessage]] = {
    **{
        message.__name__: message
        for message in (
            ActuatorCommand,
            EcuStatus,
            ThrottleStatus,
            EngineStatus,
            OpticalSpeed,
            RiderControls,
            ChassisStatus,
            Temperatures,
            TrialStatus,
        )
    },
    "RearTeeth": ToothIntervals,
    "FrontTeeth": ToothIntervals,
    "RearEncoderStatus": EncoderStatus,
    "FrontEncoderStatus": EncoderStatus,
}
"""Messages that the bench's own database has, by name."""

KINDS = {**MESSAGES, "RearWheelSpeed": WheelSpeed, "FrontWheelSpeed": WheelSpeed}
"""All messages, those included that a binding has in place of tooth times."""

BENCH_SENDS = ("ActuatorCommand", "TrialStatus")
"""Messages that the bench sends; it receives all others."""


@dataclass(frozen=True)
class SignalAt:
    """One field in one signal: value in SI = sign * SI(physical) * radius + offset.

    unit    in place of the database's; None: the database's
    to      SI unit of the field; None: that of the unit (see slot.SI)
    values  raw value -> value of the field, for enumerations and truth values
    unknown physical values that mean "not known"
    valid   signal of the same message that is 0 where the value is not valid; "" where there is none
    """

    message: str
    signal: str
    unit: str | None = None
    to: str | None = None
    sign: int = 1
    offset: float = 0.0
    radius: float = 1.0
    values: Mapping[int, int] = field(default_factory=dict)
    unknown: tuple[float, ...] = ()
    valid: str = ""


@dataclass(frozen=True)
class TeethAt:
    """Tooth intervals: the multiplexer `layout` selects their signals."""

    message: str
    layout: str = "layout"
    count: str = "tooth_count"


FieldsAt = Mapping[str, SignalAt | float]  # a number is the field's constant value
Placement = Mapping[str, FieldsAt | TeethAt]  # by name of the bench's message


def carriers_of(at: FieldsAt | TeethAt) -> list[str]:
    """Messages of the database that hold fields of one message of the bench."""
    if isinstance(at, TeethAt):
        return [at.message]
    found = [place.message for place in at.values() if isinstance(place, SignalAt)]
    return list(dict.fromkeys(found))


def buses_of(database: Database, placement: Placement) -> tuple[str, ...]:
    """Names of the buses of all that is placed, sorted; "": one without a name."""
    held = {carrier for at in placement.values() for carrier in carriers_of(at)}
    return tuple(sorted({each.bus for each in database.messages if each.name in held}))


def _own(name: str, kind: type[BenchMessage]) -> FieldsAt | TeethAt:
    if kind is ToothIntervals:
        return TeethAt(name)
    return {each.name: SignalAt(name, each.name) for each in fields(kind)}


OWN: Placement = {name: _own(name, kind) for name, kind in MESSAGES.items()}
"""The bench's own database: messages and signals have the names of messages and fields."""

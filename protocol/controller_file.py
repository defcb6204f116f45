"""A slip controller as its TOML file describes it: what a design writes and a trial runs."""

import math
from pathlib import Path
from typing import Annotated, Literal

import tomli_w
from pydantic import AfterValidator, Field, model_validator

from slipbench.protocol.configuration import MetresPerSecond, Seconds, Section

LARGEST = 1e12
"""Largest magnitude of a gain or coefficient, SI: sums and products of them stay finite."""
Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]


def _stable(row: tuple[float, ...]) -> tuple[float, ...]:
    """Return a section whose poles lie inside the unit circle (Jury's conditions).

    Raises ValueError for any other: its state would grow without bound.
    """
    a1, a2 = row[3:]
    if not (abs(a2) < 1.0 and abs(a1) < 1.0 + a2):
        raise ValueError(
            f"the section with a1 = {a1:g}, a2 = {a2:g} is unstable;"
            " |a2| < 1 and |a1| < 1 + a2 are expected"
        )
    return row


def _not_zero(number: float) -> float:
    """Return a number that something is divided by; raises ValueError for 0, or almost."""
    if abs(number) * LARGEST < 1.0:
        raise ValueError(f"at least {1.0 / LARGEST:g} or at most {-1.0 / LARGEST:g} is expected")
    return number


Divisor = Annotated[Number, AfterValidator(_not_zero)]
Delay = Annotated[int, Field(ge=0, le=10_000)]
"""Periods, as many as a controller keeps commands of."""
SectionRow = Annotated[tuple[Number, Number, Number, Number, Number], AfterValidator(_stable)]
"""b0, b1, b2, a1, a2 of (b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2); stable."""
Sections = Annotated[tuple[SectionRow, ...], Field(max_length=50)]


class Bounds(Section):
    """Range of a command about its operating point, SI, and its fastest change per second."""

    low: float
    high: float
    rate: float = Field(gt=0)

    @model_validator(mode="after")
    def _ordered(self) -> "Bounds":
        if not self.low < self.high:
            raise ValueError(f"low = {self.low:g} must lie below high = {self.high:g}")
        return self


class PidGains(Section):
    """Gains of a PID, SI: command per slip; integral per second, derivative times a second."""

    kind: Literal["pid"] = "pid"
    proportional: Number
    integral: Number
    derivative: Number
    filter_time: Seconds = Field(gt=0)
    tracking_time: Seconds = Field(gt=0)
    reference_weight: Number = 1.0


class ModelSections(Section):
    """Internal model control: sections of the model and of its inverse; delay in periods."""

    kind: Literal["internal_model"] = "internal_model"
    model: Sections
    inverse: Sections
    delay: Delay

    @model_validator(mode="after")
    def _late(self) -> "ModelSections":
        if math.prod(row[0] for row in self.model) != 0.0:
            raise ValueError("no section of the model has b0 = 0: a command acts after its period")
        return self


class LinearSections(Section):
    """Any linear law: an integral (1/s), and beside it sections that act on the error too."""

    kind: Literal["linear"] = "linear"
    integral: Number
    shaping: Sections
    tracking_time: Seconds = Field(gt=0)


Law = Annotated[PidGains | ModelSections | LinearSections, Field(discriminator="kind")]


class ScheduledGains(Section):
    """A PID for one speed; between speeds the gains are interpolated."""

    speed: MetresPerSecond
    gains: PidGains


class Mixed(Section):
    """The throttle of a mixed controller, whose spark helps where the throttle is too slow.

    law, throttle: internal model control through the throttle, and its range; later, delay: how
    much later than a spark the throttle acts, delay in periods; zone: spark (rad) below which what
    is left to the spark is taken for sensor noise; exchange: throttle per spark with the same slip
    at rest.
    """

    law: ModelSections
    throttle: Bounds
    later: Sections
    delay: Delay
    zone: float = Field(ge=0)
    exchange: Divisor


class GovernorTable(Section):
    """Range and rate of the slip that may be asked for; gain: slip per command."""

    slip: Bounds
    gain: Divisor


class ControllerFile(Section):
    """One controller file. `limits` are of the actuator that `law` moves, about its rest.

    prefilter: sections that the reference passes through, steady gain 1. designed: what the design
    promises, for people; it changes nothing.
    """

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")
    actuator: Literal["throttle", "spark", "mixed"]
    period: Seconds = Field(default=0.001, ge=1e-5, le=1.0)
    law: Law
    limits: Bounds
    schedule: tuple[ScheduledGains, ...] = ()
    mixed: Mixed | None = None
    governor: GovernorTable | None = None
    prefilter: Sections = ()
    designed: dict[str, float | str] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _complete(self) -> "ControllerFile":
        if (self.actuator == "mixed") != (self.mixed is not None):
            raise ValueError("actuator = 'mixed' and a table [mixed] belong together")
        if self.mixed and self.law.kind != "internal_model":
            raise ValueError(f"mixed control is by internal models; law.kind = '{self.law.kind}'")
        if self.schedule and self.law.kind != "pid":
            raise ValueError(f"a schedule is of PID gains; law.kind = '{self.law.kind}' has none")
        speeds = [entry.speed for entry in self.schedule]
        if speeds != sorted(set(speeds)):
            raise ValueError("speeds of the schedule must increase")
        return self


def write_controller(controller: ControllerFile, path: Path) -> None:
    """Write a controller file; `configuration.read_toml(path, ControllerFile)` gives it back."""
    tree = controller.model_dump(mode="json", exclude_none=True)
    path.write_text(tomli_w.dumps(tree), encoding="utf-8")

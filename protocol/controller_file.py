"""A slip controller as its TOML file describes it: what a design writes and a trial runs."""

import math
from pathlib import Path
from typing import Annotated, Literal

import tomli_w
from pydantic import AfterValidator, Field, model_validator

from slipbench.protocol.configuration import MetresPerSecond, Seconds, Section, Unit

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
Delay = Annotated[int, Field(ge=0, le=10_000), Unit("periods")]
"""Periods, as many as a controller keeps commands of."""
SectionRow = Annotated[tuple[Number, Number, Number, Number, Number], AfterValidator(_stable)]
"""b0, b1, b2, a1, a2 of (b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2); stable."""
Sections = Annotated[tuple[SectionRow, ...], Field(max_length=50)]
Command = Annotated[float, Unit("of the quantity, SI")]
Rate = Annotated[float, Field(gt=0), Unit("of the quantity per s, SI")]


class Bounds(Section):
    """Range of a command about its operating point, and its fastest change.

    low   lowest value
    high  highest value
    rate  fastest change
    """

    low: Command
    high: Command
    rate: Rate

    @model_validator(mode="after")
    def _ordered(self) -> "Bounds":
        if not self.low < self.high:
            raise ValueError(f"low = {self.low:g} must lie below high = {self.high:g}")
        return self


class PidGains(Section):
    """Gains of a PID (controllers/pid.py): Astroem and Haegglund, Advanced PID Control (2006).

    kind              law of this table
    proportional      proportional gain
    integral          integral gain
    derivative        derivative gain
    filter_time       time constant of the filter of the derivative
    tracking_time     of the anti-windup by back-calculation
    reference_weight  weight of the reference in the proportional part
    """

    kind: Literal["pid"] = "pid"
    proportional: Annotated[Number, Unit("command per slip")]
    integral: Annotated[Number, Unit("command per slip and s")]
    derivative: Annotated[Number, Unit("command per slip, times s")]
    filter_time: Seconds = Field(gt=0)
    tracking_time: Seconds = Field(gt=0)
    reference_weight: Annotated[Number, Unit("1")] = 1.0


class ModelSections(Section):
    """Internal model control: sections of the model and of its inverse.

    kind     law of this table
    model    sections of the model without its delay
    inverse  sections of the filtered inverse of the model
    delay    dead time of the model
    """

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
    """Any linear law: an integral and parallel sections, both driven by the error.

    kind           law of this table
    integral       gain of the integral
    shaping        sections beside the integral
    tracking_time  of the anti-windup by back-calculation
    """

    kind: Literal["linear"] = "linear"
    integral: Annotated[Number, Unit("command per slip and s")]
    shaping: Sections
    tracking_time: Seconds = Field(gt=0)


Law = Annotated[PidGains | ModelSections | LinearSections, Field(discriminator="kind")]


class ScheduledGains(Section):
    """A PID for one speed; between speeds the gains are interpolated.

    speed  speed of the motorcycle; speeds increase from entry to entry
    gains  of the PID at that speed
    """

    speed: MetresPerSecond
    gains: PidGains


class Mixed(Section):
    """The throttle of a mixed controller, whose spark helps where the throttle is too slow.

    law       internal model control through the throttle
    throttle  range of the throttle
    later     sections: how much later than a spark the throttle acts
    delay     dead time of the same
    zone      spark below which what remains for the spark is taken for sensor noise
    exchange  throttle per spark with the same slip at rest
    """

    law: ModelSections
    throttle: Bounds
    later: Sections
    delay: Delay
    zone: Annotated[float, Field(ge=0), Unit("rad")]
    exchange: Annotated[Divisor, Unit("1/rad")]


class GovernorTable(Section):
    """Limits of the slip that may be requested (reference governor).

    slip  range and rate of the reference
    gain  slip per command, at rest
    """

    slip: Bounds
    gain: Annotated[Divisor, Unit("slip per command")]


class ControllerFile(Section):
    """One controller file.

    A section is a row [b0, b1, b2, a1, a2] of (b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2).

    name       of the controller
    actuator   what the controller moves
    period     of the controller
    law        control law
    limits     range of the actuator that `law` moves, about its operating point
    schedule   gains by speed, of a PID
    mixed      throttle of a mixed controller
    governor   limits of the reference
    prefilter  sections that the reference passes through, DC gain 1
    designed   what the design promises, for people; it changes nothing
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

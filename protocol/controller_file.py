"""A slip controller as its TOML file describes it: what a design writes and a trial runs."""

from pathlib import Path
from typing import Annotated, Literal

import tomli_w
from pydantic import Field, model_validator

from slipbench.protocol.configuration import MetresPerSecond, Seconds, Section, Unit

SectionRow = tuple[float, float, float, float, float]
"""b0, b1, b2, a1, a2 of (b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2)."""
Command = Annotated[float, Unit("of the quantity, SI")]
Rate = Annotated[float, Field(gt=0), Unit("of the quantity per s, SI")]
Periods = Annotated[int, Field(ge=0), Unit("periods")]


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
    proportional: Annotated[float, Unit("command per slip")]
    integral: Annotated[float, Unit("command per slip and s")]
    derivative: Annotated[float, Unit("command per slip, times s")]
    filter_time: Seconds = Field(gt=0)
    tracking_time: Seconds = Field(gt=0)
    reference_weight: Annotated[float, Unit("1")] = 1.0


class ModelSections(Section):
    """Internal model control: sections of the model and of its inverse.

    kind     law of this table
    model    sections of the model without its delay
    inverse  sections of the filtered inverse of the model
    delay    dead time of the model
    """

    kind: Literal["internal_model"] = "internal_model"
    model: tuple[SectionRow, ...]
    inverse: tuple[SectionRow, ...]
    delay: Periods


class LinearSections(Section):
    """Any linear law: an integral, and beside it sections that act on the error too.

    kind           law of this table
    integral       gain of the integral
    shaping        sections beside the integral
    tracking_time  of the anti-windup by back-calculation
    """

    kind: Literal["linear"] = "linear"
    integral: Annotated[float, Unit("command per slip and s")]
    shaping: tuple[SectionRow, ...]
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
    later: tuple[SectionRow, ...]
    delay: Periods
    zone: Annotated[float, Field(ge=0), Unit("rad")]
    exchange: Annotated[float, Unit("1/rad")]


class GovernorTable(Section):
    """Limits of the slip that may be requested (reference governor).

    slip  range and rate of the reference
    gain  slip per command, at rest
    """

    slip: Bounds
    gain: Annotated[float, Unit("slip per command")]


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
    period: Seconds = 0.001
    law: Law
    limits: Bounds
    schedule: tuple[ScheduledGains, ...] = ()
    mixed: Mixed | None = None
    governor: GovernorTable | None = None
    prefilter: tuple[SectionRow, ...] = ()
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

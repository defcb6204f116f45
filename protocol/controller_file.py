"""A slip controller as its TOML file describes it: what a design writes and a trial runs."""

from pathlib import Path
from typing import Annotated, Literal

import tomli_w
from pydantic import Field, model_validator

from slipbench.protocol.configuration import MetresPerSecond, Seconds, Section

SectionRow = tuple[float, float, float, float, float]
"""b0, b1, b2, a1, a2 of (b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2)."""


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
    proportional: float
    integral: float
    derivative: float
    filter_time: Seconds = Field(gt=0)
    tracking_time: Seconds = Field(gt=0)
    reference_weight: float = 1.0


class ModelSections(Section):
    """Internal model control: sections of the model and of its inverse; delay in periods."""

    kind: Literal["internal_model"] = "internal_model"
    model: tuple[SectionRow, ...]
    inverse: tuple[SectionRow, ...]
    delay: int = Field(ge=0)


class LinearSections(Section):
    """Any linear law: an integral (1/s), and beside it sections that act on the error too."""

    kind: Literal["linear"] = "linear"
    integral: float
    shaping: tuple[SectionRow, ...]
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
    later: tuple[SectionRow, ...]
    delay: int = Field(ge=0)
    zone: float = Field(ge=0)
    exchange: float


class GovernorTable(Section):
    """Range and rate of the slip that may be asked for; gain: slip per command."""

    slip: Bounds
    gain: float


class ControllerFile(Section):
    """One controller file. `limits` are of the actuator that `law` moves, about its rest.

    prefilter: sections that the reference passes through, steady gain 1. designed: what the design
    promises, for people; it changes nothing.
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

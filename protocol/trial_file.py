"""A trial as its TOML file describes it: what is excited, when, and within which limits."""

from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from slipbench.protocol.configuration import (
    Hertz,
    Metres,
    MetresPerSecond,
    Radians,
    RadiansPerSecond,
    Ratio,
    RatioPerSecond,
    Seconds,
    Section,
)

RPM = 0.10471975511965977  # rad/s


class OperatingPoint(Section):
    """Where the rider must hold the motorcycle before the bench arms."""

    gear: int = Field(ge=1, le=8)
    engine_speed: RadiansPerSecond
    engine_speed_window: RadiansPerSecond = Field(default=300 * RPM, gt=0)
    steady_for: Seconds = Field(default=0.5, gt=0)


class _Excitation(Section):
    """What every waveform has: an actuator, an amplitude in its unit, a duration."""

    actuator: Literal["throttle", "spark", "slip"]  # slip: the target of a controller
    amplitude: str | float
    duration: Seconds = Field(gt=0, le=3600)  # its whole table is made before the bench arms


class Sweep(_Excitation):
    """A sine whose frequency runs from `start` to `stop`."""

    waveform: Literal["linear_sweep", "logarithmic_sweep"]
    start: Hertz = Field(gt=0)
    stop: Hertz = Field(gt=0)


class Square(_Excitation):
    """A square wave: opening and closing steps about the operating point."""

    waveform: Literal["square"]
    frequency: Hertz = Field(gt=0)


class Multisine(_Excitation):
    """A random-phase odd multisine: odd harmonics of 1 / `period` between two frequencies.

    With `detection`, one odd line of every four is left free, so that odd distortion shows there.
    """

    waveform: Literal["multisine"]
    lowest: Hertz = Field(gt=0)
    highest: Hertz = Field(gt=0)
    period: Seconds = Field(gt=0)
    seed: int = 1
    detection: bool = False


Excitation = Annotated[Sweep | Square | Multisine, Field(discriminator="waveform")]


class Command(Section):
    """How the bench speaks to the actuators."""

    period: Seconds = 0.001
    silence: Seconds = 0.020  # the devices take authority back after this much silence

    @field_validator("period")
    @classmethod
    def _whole_milliseconds(cls, period: float) -> float:
        ticks = round(period / 0.001)
        if ticks < 1 or abs(period - ticks * 0.001) > 1e-9:
            raise ValueError("must be a whole number of milliseconds, 1 ms or more")
        return ticks * 0.001

    @model_validator(mode="after")
    def _speaks_often_enough(self) -> "Command":
        if not self.period < self.silence:
            raise ValueError(
                f"period = {self.period:g} s is not below silence = {self.silence:g} s: the devices"
                " would take authority back between two commands"
            )
        return self


class Limits(Section):
    """What `permit` lets through, and what trips the trial."""

    throttle: tuple[Ratio, Ratio] = (0.0, 1.0)
    throttle_deviation: Ratio = Field(gt=0)  # from the operating point, of command and grip
    throttle_rate: RatioPerSecond = Field(gt=0)
    spark: tuple[Radians, Radians]  # offset from the map
    spark_rate: RadiansPerSecond = Field(gt=0)
    engine_speed: tuple[RadiansPerSecond, RadiansPerSecond]
    speed: tuple[MetresPerSecond, MetresPerSecond]
    slip: Ratio = Field(gt=0)  # of the rear wheel, either way
    front_slip: Ratio = Field(default=0.1, gt=0)  # of the front wheel, which rolls, either way
    distance: Metres = Field(gt=0)  # from the button on
    grip_closed: Ratio = 0.02  # the rider lets go below it
    brake_pressure: Annotated[float, Field(gt=0)] = 2e5  # Pa
    clutch: Ratio = 0.1
    stale: Seconds = 0.015  # no frame of a safety-relevant status for this long
    faults: int = Field(default=3, ge=1)  # consecutive faulty frames of one message that trip

    @model_validator(mode="after")
    def _ordered(self) -> "Limits":
        for name in ("throttle", "spark", "engine_speed", "speed"):
            low, high = getattr(self, name)
            if not low < high:
                raise ValueError(f"{name} = [{low:g}, {high:g}]: the lower bound comes first")
        return self


class Timing(Section):
    """How late the loop may be before its trial counts as invalid.

    A command that is late by `late` stands where the waveform was `late` ago. Half a tick is as
    much as a device that hears a command every tick cannot tell from the bus's own jitter.
    """

    late: Seconds = Field(default=0.0005, gt=0)  # a tick that begins later than this is late
    budget: Ratio = 0.01  # of the ticks with authority; more late, refused or skipped: invalid


class Controller(Section):
    """Slip control inside the trial: the waveform moves the target, not the actuator.

    file: a controller file, relative to the trial file. target: slip; None for what stands at the
    button.
    """

    file: str
    target: Ratio | None = None


class Stretch(Section):
    """Part of the road that the virtual motorcycle meets, counted from the button."""

    of: Literal["grip", "load"]
    start: Metres = Field(alias="from")
    end: Metres = Field(alias="to")
    factor: float = Field(gt=0)

    @model_validator(mode="after")
    def _ordered(self) -> "Stretch":
        if not self.start < self.end:
            raise ValueError(f"from = {self.start:g} m lies behind to = {self.end:g} m")
        return self


class VirtualRider(Section):
    """What the scripted rider of the virtual motorcycle does."""

    presses_button_after: Seconds = 1.0  # from the moment the bench has armed
    holds_button_for: Seconds | None = None  # None: until the bench is done


class TrialFile(Section):
    """One trial file."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")
    description: str = ""
    vehicle: str  # path of the vehicle file, relative to the trial file
    seed: int = 1
    operating_point: OperatingPoint
    excitation: Excitation
    command: Command = Command()
    settling: Seconds = Field(default=1.0, ge=0)
    hand_back: Seconds = Field(default=0.5, gt=0)
    ready_within: Seconds = Field(default=120.0, gt=0)
    armed_for_at_most: Seconds = Field(default=120.0, gt=0)
    limits: Limits
    timing: Timing = Timing()
    rider: VirtualRider = VirtualRider()
    controller: Controller | None = None
    road: tuple[Stretch, ...] = ()

    @model_validator(mode="after")
    def _controller_and_target(self) -> "TrialFile":
        if (self.excitation.actuator == "slip") != (self.controller is not None):
            raise ValueError("excitation.actuator = 'slip' and a table [controller] go together")
        return self

    @model_validator(mode="after")
    def _hand_back_fits(self) -> "TrialFile":
        fastest = self.limits.throttle_deviation / self.hand_back
        if fastest > self.limits.throttle_rate:
            raise ValueError(
                f"hand_back = {self.hand_back:g} s could ask for {fastest:.3g}/s, more than "
                f"limits.throttle_rate = {self.limits.throttle_rate:.3g}/s; lengthen it"
            )
        return self

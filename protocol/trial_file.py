"""A trial file: what is excited, when, and within which limits. Every bound has its reason."""

from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from slipbench.protocol.configuration import Section
from slipbench.protocol.quantity import Between, BetweenBy, Whole, of_recording, shown

RPM = 0.10471975511965977  # rad/s
MILLISECOND = 0.001  # s, period of the fastest status on the bus
Seed = Annotated[int, Field(ge=0, le=2**63 - 1)]


def _default(value: str) -> float:
    """Return the field of a quantity with a default, which is checked like a written one."""
    return Field(default=value, validate_default=True)  # type: ignore[no-any-return]


EngineSpeed = Annotated[
    float,
    Between(
        "rpm", "500 rpm", "20000 rpm", "an engine below it stalls and no motorcycle turns faster"
    ),
]
Speed = Annotated[
    float,
    Between(
        "m/s",
        "3 m/s",
        "110 m/s",
        "slip is not known below 3 m/s and no motorcycle on a track is faster than 110 m/s",
    ),
]
Opening = Annotated[
    float,
    Between(
        "",
        "0.1 %",
        "99 %",
        "the throttle's stops are 0 % and 100 %: a limit there could never trip",
    ),
]
SparkOffset = Annotated[
    float,
    Between(
        "rad",
        "-25 deg",
        "15 deg",
        "more retard overheats the exhaust and more advance makes the engine knock",
    ),
]
Frequency = Annotated[
    float, Between("Hz", "0.001 Hz", "500 Hz", "commands are sent at most every millisecond")
]


class OperatingPoint(Section):
    """Where the rider must hold the motorcycle before the bench arms.

    gear                 gear engaged
    engine_speed         crank speed that the rider holds
    engine_speed_window  largest distance from it, either way
    steady_for           time that the engine speed must stay in the window
    """

    gear: int = Field(ge=1, le=8)
    engine_speed: EngineSpeed
    engine_speed_window: Annotated[
        float, Between("rpm", "0.1 rpm", "1000 rpm", "further off it is another operating point")
    ] = _default("300 rpm")
    steady_for: Annotated[
        float, Between("s", "50 ms", "60 s", "engine speed is sent every 5 ms and must settle")
    ] = _default("500 ms")


# By actuator, the largest amplitude of an excitation. Zero is for a slip target that stands still.
AMPLITUDES = {
    "throttle": Between("", "0 %", "25 %", "more is no small signal about an operating point"),
    "spark": Between("rad", "0 deg", "15 deg", "more advance makes the engine knock"),
    "slip": Between("", "0 %", "30 %", "a tyre slides from about 10 % to 20 % of slip on"),
}


class _Excitation(Section):
    """What every waveform has: an actuator, an amplitude in its unit, a duration.

    actuator   what the waveform is added to; "slip": the target of [controller]
    amplitude  half the range from the lowest to the highest command
    duration   of the waveform; the trial ends after it
    """

    actuator: Literal["throttle", "spark", "slip"]
    amplitude: Annotated[float, BetweenBy("actuator", AMPLITUDES)]
    duration: Annotated[
        float,
        Between("s", "100 ms", "3600 s", "less identifies nothing and the loop counts one hour"),
    ]


class Sweep(_Excitation):
    """A sine whose frequency runs from `start` to `stop`.

    waveform  the frequency rises linearly, or by the same factor in equal times
    start     first frequency
    stop      last frequency
    """

    waveform: Literal["linear_sweep", "logarithmic_sweep"]
    start: Frequency
    stop: Frequency


class Square(_Excitation):
    """A square wave: opening and closing steps about the operating point.

    waveform   steps between two values
    frequency  of the square wave; two steps a period
    """

    waveform: Literal["square"]
    frequency: Frequency


class Multisine(_Excitation):
    """A random-phase odd multisine: odd harmonics of 1 / `period` between two frequencies.

    waveform   sum of sines
    lowest     lowest frequency with power
    highest    highest frequency with power
    period     of the sum; its inverse is the distance of the lines
    seed       of the random phases
    detection  one odd line of every four has no power, so that odd distortion shows there
    """

    waveform: Literal["multisine"]
    lowest: Frequency
    highest: Frequency
    period: Annotated[
        float, Between("s", "10 ms", "600 s", "the trial plays at least one whole period")
    ]
    seed: Seed = 1
    detection: bool = False


Excitation = Annotated[Sweep | Square | Multisine, Field(discriminator="waveform")]


class Command(Section):
    """How the bench commands the actuators.

    period   from one command to the next, a whole number of milliseconds
    silence  watchdog timeout of the devices: without a command for that long, they return
             authority to the rider; longer than `period`
    """

    period: Annotated[
        float,
        Between("s", "1 ms", "10 ms", "an actuator that is commanded less often moves in steps"),
    ] = _default("1 ms")
    silence: Annotated[
        float,
        Between("s", "2 ms", "50 ms", "for that long the last command acts with the bench dead"),
    ] = _default("20 ms")

    @field_validator("period", mode="after")
    @classmethod
    def _whole_milliseconds(cls, period: float) -> float:
        if abs(period - round(period / MILLISECOND) * MILLISECOND) > 1e-9:
            raise ValueError("must be a whole number of milliseconds, 1 ms or more")
        return period

    @model_validator(mode="after")
    def _speaks_often_enough(self) -> "Command":
        if not self.period < self.silence:
            raise ValueError(
                f"period = {self.period} is not below silence = {self.silence}: the devices"
                " would return authority between two commands"
            )
        return self


class Limits(Section):
    """What `permit` lets through, and what trips the trial.

    throttle            lowest and highest command
    throttle_deviation  largest distance from the operating point, of the command and of the
                        rider's grip
    throttle_rate       fastest change of the command
    spark               lowest and highest offset from the map; negative: retarded
    spark_rate          fastest change of the offset
    engine_speed        lowest and highest crank speed
    speed               lowest and highest speed of the motorcycle
    slip                largest slip of the rear wheel, either sign
    front_slip          largest slip of the front wheel, either sign
    distance            longest way from the button on
    grip_closed         below it the rider closes the throttle
    brake_pressure      above it the rider brakes
    clutch              above it the rider pulls the clutch
    stale               longest silence of a safety-relevant status
    faults              consecutive faulty frames of one message that trip the trial
    """

    throttle: tuple[Opening, Opening] = Field(default=("0.1 %", "99 %"), validate_default=True)
    throttle_deviation: Annotated[
        float,
        Between("", "0.05 %", "25 %", "the throttle steps by as much when the rider takes over"),
    ]
    throttle_rate: Annotated[
        float,
        Between("1/s", "1 %/s", "2000 %/s", "no servo opens faster: the limit could never trip"),
    ]
    spark: tuple[SparkOffset, SparkOffset]
    spark_rate: Annotated[
        float,
        Between(
            "rad/s",
            "1 deg/s",
            "2000 deg/s",
            "the whole range within 20 ms is a step: the limit could never trip",
        ),
    ]
    engine_speed: tuple[EngineSpeed, EngineSpeed]
    speed: tuple[Speed, Speed]
    slip: Annotated[
        float, Between("", "0.1 %", "30 %", "a tyre slides from about 10 % to 20 % of slip on")
    ]
    front_slip: Annotated[
        float,
        Between("", "1 %", "30 %", "a front wheel that is 30 % off the speed locks or is in air"),
    ] = _default("10 %")
    distance: Annotated[
        float, Between("m", "1 m", "9000 m", "no test track has a longer straight (8.7 km)")
    ]
    grip_closed: Annotated[
        float, Between("", "0.5 %", "20 %", "the sensor's zero is uncertain by 0.5 %")
    ] = _default("2 %")
    brake_pressure: Annotated[
        float, Between("Pa", "0.4 bar", "10 bar", "at 10 bar the rider brakes hard already")
    ] = _default("2 bar")
    clutch: Annotated[
        float, Between("", "2 %", "50 %", "a clutch pulled by half transmits no torque any more")
    ] = _default("10 %")
    stale: Annotated[
        float,
        Between(
            "s",
            "6 ms",
            "50 ms",
            "statuses come every 5 ms and for that long the bench drives without seeing",
        ),
    ] = _default("15 ms")
    faults: Annotated[
        int, Whole(1, 10, "ten faulty frames in a row are no disturbance but a broken sensor")
    ] = 3

    @model_validator(mode="after")
    def _ordered(self) -> "Limits":
        for name in ("throttle", "spark", "engine_speed", "speed"):
            low, high = getattr(self, name)
            if not low < high:
                raise ValueError(f"{name} = [{low}, {high}]: the lower bound comes first")
        return self

    @model_validator(mode="after")
    def _faults_before_stale(self, info: ValidationInfo) -> "Limits":
        if not of_recording(info) and not self.faults * MILLISECOND < self.stale:
            raise ValueError(
                f"faults = {self.faults} could never trip: {self.faults} frames of a status that"
                f" comes every millisecond last as long as stale = {self.stale}"
            )
        return self


class Timing(Section):
    """How late the loop may be before its trial counts as invalid.

    late    a tick that begins later than this is late. A command that is late by `late` has the
            value that the waveform had `late` ago; half a tick is as much as a device that hears a
            command every tick cannot distinguish from the jitter of the bus.
    budget  of the ticks with authority; more late, refused or skipped ticks: the trial is invalid
    """

    late: Annotated[
        float, Between("s", "10 us", "5 ms", "later commands are others than the analysis assumes")
    ] = _default("500 us")
    budget: Annotated[
        float, Between("", "0 %", "10 %", "with more ticks missing it is another waveform")
    ] = _default("1 %")


class Controller(Section):
    """Slip control inside the trial: the waveform moves the target, not the actuator.

    file    controller file, relative to the trial file
    target  slip about which the waveform moves; none: the slip at the button
    """

    file: str
    target: (
        Annotated[
            float, Between("", "-30 %", "30 %", "a tyre slides from about 10 % to 20 % of slip on")
        ]
        | None
    ) = None


Place = Annotated[float, Between("m", "0 m", "100 km", "a trial lasts at most an hour")]


class Stretch(Section):
    """Part of the road that the virtual motorcycle rides on, counted from the button.

    of      what differs there: friction of the road, or load on the rear wheel
    from    begin of the part
    to      end of the part
    factor  of the friction or of the load there against the rest of the road
    """

    of: Literal["grip", "load"]
    start: Place = Field(alias="from")
    end: Place = Field(alias="to")
    factor: float = Field(ge=0.01, le=3.0)

    @model_validator(mode="after")
    def _ordered(self) -> "Stretch":
        if not self.start < self.end:
            raise ValueError(f"from = {self.start} lies behind to = {self.end}")
        return self


Wait = Annotated[float, Between("s", "0 s", "600 s", "nobody rides longer before a trial")]


class VirtualRider(Section):
    """What the scripted rider of the virtual motorcycle does.

    presses_button_after  time from the moment when the bench has armed
    holds_button_for      time; none: until the bench has finished
    """

    presses_button_after: Wait = _default("1 s")
    holds_button_for: (
        Annotated[float, Between("s", "0 s", "3600 s", "the loop counts one hour")] | None
    ) = None


class TrialFile(Section):
    """One trial file.

    name               of the trial and of its run folder
    description        text for people
    vehicle            vehicle file, relative to the trial file
    seed               of the virtual motorcycle's noise
    excitation         waveform that is added to the command
    settling           time at the operating point after the waveform, before the hand-back
    hand_back          time of the ramp from the last command to what the rider's grip requests
    ready_within       longest wait for the operating point
    armed_for_at_most  longest wait for the rider's button
    """

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=100)
    description: str = ""
    vehicle: str
    seed: Seed = 1
    operating_point: OperatingPoint
    excitation: Excitation
    command: Command = Command()
    settling: Annotated[
        float, Between("s", "0 s", "60 s", "the rider waits for the throttle meanwhile")
    ] = _default("1 s")
    hand_back: Annotated[
        float,
        Between("s", "50 ms", "10 s", "a quicker ramp is a step and a longer one keeps the rider"),
    ] = _default("500 ms")
    ready_within: Annotated[float, Between("s", "100 ms", "3600 s", "the loop counts one hour")] = (
        _default("120 s")
    )
    armed_for_at_most: Annotated[
        float, Between("s", "100 ms", "3600 s", "the loop counts one hour")
    ] = _default("120 s")
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
        rate = self.limits.throttle_rate
        fastest = self.limits.throttle_deviation / self.hand_back
        if fastest > rate:
            raise ValueError(
                f"hand_back = {self.hand_back} could ask for {shown(fastest, rate)}, more than"
                f" limits.throttle_rate = {rate}; lengthen it"
            )
        return self

    @model_validator(mode="after")
    def _rates_can_trip(self, info: ValidationInfo) -> "TrialFile":
        limits, period = self.limits, self.command.period
        for name, rate, most in (
            ("throttle_rate", limits.throttle_rate, 2 * limits.throttle_deviation),
            ("spark_rate", limits.spark_rate, limits.spark[1] - limits.spark[0]),
        ):
            if not of_recording(info) and rate * period >= most:
                raise ValueError(
                    f"limits.{name} = {rate} could never trip: from one command to the next, after"
                    f" {period}, the other limits permit a change of"
                    f" {shown(most / period, rate)} at most; lower it"
                )
        return self

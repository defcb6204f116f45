"""A session plan: which trials are run, how often and in which order."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from slipbench.protocol.configuration import Section, read_toml
from slipbench.protocol.quantity import Whole
from slipbench.protocol.recording.tags import Tags
from slipbench.protocol.trial_file import EngineSpeed, Excitation, Speed


class PlannedTrial(Section):
    """Runs of one trial: a trial file, and what differs from it.

    name          of the trial and of its run folders
    file          trial file, relative to the plan, or the name of one that ships with slipbench
    repeats       runs with a usable recording
    actuator      in place of excitation.actuator; needs `amplitude` in its unit
    amplitude     in place of excitation.amplitude
    excitation    in place of the whole table [excitation]
    gear          in place of operating_point.gear
    engine_speed  lowest and highest crank speed at which the bench arms
    speed         the same as speeds of the motorcycle, in the gear of the trial without slip
    """

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_]*$", max_length=80)
    file: str
    repeats: Annotated[
        int, Whole(1, 50, "a day has no more laps, and intervals hardly shrink from there")
    ] = 3
    actuator: Literal["throttle", "spark", "slip"] | None = None
    amplitude: str | None = None
    excitation: Excitation | None = None
    gear: int | None = Field(default=None, ge=1, le=8)
    engine_speed: tuple[EngineSpeed, EngineSpeed] | None = None
    speed: tuple[Speed, Speed] | None = None

    @model_validator(mode="after")
    def _stated_once(self) -> "PlannedTrial":
        if self.excitation is not None and (self.actuator or self.amplitude):
            raise ValueError(
                "excitation replaces the whole table: write actuator and amplitude inside it"
            )
        if self.actuator and not self.amplitude:
            raise ValueError("actuator needs an amplitude in the unit of that actuator")
        if self.engine_speed and self.speed:
            raise ValueError("engine_speed and speed both state the window: remove one of them")
        return self

    @model_validator(mode="after")
    def _ordered(self) -> "PlannedTrial":
        for name in ("engine_speed", "speed"):
            window = getattr(self, name)
            if window is not None and not window[0] < window[1]:
                raise ValueError(
                    f"{name} = [{window[0]}, {window[1]}]: the lower bound comes first"
                )
        return self


class SessionPlan(Section):
    """One plan of a session.

    name         of the session
    description  text for people
    order        fixed: all runs of the first trial, then those of the next; interleaved: one run of
                 each trial in turn, so that slow changes (tyres, fuel, weather) meet all alike
    attempts     at a run whose quick look asks for a repetition
    tags         what the frames do not have, such as track, tyre, mileage, temperature; they go into
                 run.toml of every run
    trial        the trials
    """

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=100)
    description: str = ""
    order: Literal["fixed", "interleaved"] = "interleaved"
    attempts: Annotated[int, Whole(1, 5, "what fails five times will not get better")] = 2
    tags: Tags = Field(default={})
    trial: tuple[PlannedTrial, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _different_names(self) -> "SessionPlan":
        names = [each.name for each in self.trial]
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise ValueError(f"two trials have the same name: {', '.join(sorted(twice))}")
        return self


def read_plan(path: Path) -> SessionPlan:
    """Read a session plan (TOML). Raises InputError that lists every fault of the file."""
    return read_toml(path, SessionPlan)

"""An entry of the index: what is known of one run or one analysis."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime

from slipbench.identification.season.folders import Folder

LEVEL = 1.959963984540054  # standard deviations of half a 95 % interval


@dataclass(frozen=True)
class Parameter:
    """A number that was identified, in SI. low, high: its 95 % interval; None where it has none."""

    name: str
    unit: str
    value: float
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Entry:
    """Content of the files of one folder; "" and None where they do not.

    recorded     trial, import, or another kind of recording
    started      begin of the recording, UTC
    excitation   waveform and band in words; amplitude as written in the trial
    engine_speed of the operating point, rpm as the trial has it
    outcome      how the trial ended: done, tripped, ...; incomplete without an end
    verdict      of `identify`, else of the quick look, else the outcome; of `explain`: what it found
    fault        what is damaged or missing, sentences joined with "; "; "" for nothing
    tags         of the run
    parameters   by name, each once
    recording    name of the run of an `identify` in a folder of its own
    training     paths of the runs that `explain` used, relative to its folder
    """

    folder: Folder
    recorded: str = ""
    started: datetime | None = None
    vehicle: str = ""
    trial: str = ""
    actuator: str = ""
    excitation: str = ""
    amplitude: str = ""
    gear: int | None = None
    engine_speed: float | None = None
    duration: float | None = None
    outcome: str = ""
    trip: str = ""
    verdict: str = ""
    reason: str = ""
    fault: str = ""
    tags: tuple[tuple[str, int | float | str], ...] = ()
    parameters: tuple[Parameter, ...] = ()
    recording: str = ""
    training: tuple[str, ...] = ()

    def with_faults(self, *faults: str) -> "Entry":
        """The entry with these faults, too."""
        return replace(self, fault="; ".join(one for one in (self.fault, *faults) if one))

    def with_tags(self, tags: Mapping[str, int | float | str]) -> "Entry":
        """The entry with these tags in place of its own, in the order of their keys."""
        return replace(self, tags=tuple(sorted(tags.items())))


def column(*parts: str) -> str:
    """Name of a column: the parts joined with _, in small letters, without other characters."""
    return re.sub(r"\W+", "_", "_".join(part for part in parts if part)).lower()


def around(
    name: str, unit: str, value: float | None, deviation: float | None = None
) -> list[Parameter]:
    """A parameter with the 95 % interval of a standard deviation; nothing where it is unknown."""
    if value is None:
        return []
    if not deviation:
        return [Parameter(name, unit, value)]
    return [Parameter(name, unit, value, value - LEVEL * deviation, value + LEVEL * deviation)]

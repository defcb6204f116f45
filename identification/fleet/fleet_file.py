"""Read a fleet file (TOML): vehicles with their recordings.

    [[analyses]]
    name = "bike_7_round_3"
    vehicle = "bike_7.toml"
    training = ["runs/sweep", "runs/square"]
    held_out = ["runs/other"]

Paths are relative to the file.
"""

import re
from pathlib import Path

from pydantic import Field, field_validator, model_validator

from slipbench.protocol.configuration import Section, read_toml
from slipbench.protocol.shipped_files import file_or_shipped


class Entry(Section):
    """One analysis: a vehicle file and its recordings.

    name      of the analysis and of its folder of results
    vehicle   vehicle file or model file, relative to this file
    training  recordings from which the mismatch is identified
    held_out  recordings that test the result
    """

    name: str
    vehicle: str
    training: tuple[str, ...] = Field(min_length=1)
    held_out: tuple[str, ...] = ()

    @field_validator("name")
    @classmethod
    def _names_a_folder(cls, name: str) -> str:
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]*", name):
            raise ValueError("a folder will have this name: letters, digits and . _ - only")
        return name


class FleetFile(Section):
    """One fleet file.

    analyses  one entry for each analysis
    """

    analyses: tuple[Entry, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _names_differ(self) -> "FleetFile":
        names = [entry.name for entry in self.analyses]
        if twice := sorted({n for n in names if names.count(n) > 1}):
            raise ValueError(f"several analyses are called {', '.join(twice)}")
        return self


def read_fleet(path: Path) -> tuple[Entry, ...]:
    """Fleet file with absolute paths. Raises InputError where it is invalid."""
    entries = read_toml(path, FleetFile).analyses
    base = path.resolve().parent

    def found(name: str) -> str:
        return str(base / name)

    return tuple(
        Entry(
            name=e.name,
            vehicle=str(file_or_shipped(e.vehicle, "vehicle", "model", folder=base)),
            training=tuple(map(found, e.training)),
            held_out=tuple(map(found, e.held_out)),
        )
        for e in entries
    )

"""A recording is a folder: raw frames and a description, decoded afresh whenever it is read.

run.toml        what was done, by which versions, with which database; how late the ticks were
frames.log      every frame, candump text, append-only (absent where only tables were imported)
database.dbc    the database as it was; .arxml, .kcd or .sym in another format
roles.toml      the role map as it was
trial.toml      the trial as it was (absent for imported recordings)
vehicle.toml    the vehicle file as it was (absent for imported recordings)
ticks.csv       every tick of the loop: when it was due, its lateness, and whether it was sent,
                late, refused by the bus or skipped (absent when imported)
tables/*.parquet  side channels from tables
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from slipbench.protocol.extras import optional_library
from slipbench.protocol.notebook import card, table
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.role_map import RoleMap
from slipbench.protocol.trial_file import TrialFile


@dataclass(frozen=True)
class BusFault:
    """Faulty frames of one message."""

    message: str
    fault: str  # "lost", "repeated", "wrong CRC", "too short", "unknown identifier", ...
    count: int
    first_time: float  # s since the recording's start


@dataclass(frozen=True)
class Recording:
    """A recording as read: every channel on its own clock."""

    folder: Path
    description: Mapping[str, Any]  # run.toml
    trial: TrialFile | None
    roles: RoleMap
    channels: Mapping[str, Channel]
    missing: Mapping[str, str]  # role that the map names -> why the recording has no samples of it
    frame_count: int = 0
    duration: float = 0.0  # s
    start_time_ns: int = 0  # of the time zero of all channels, on the log's clock
    faults: tuple[BusFault, ...] = ()
    bus_load: Mapping[str, Any] = field(default_factory=dict)

    def to_pandas(self) -> Any:
        """A long pandas.DataFrame of all channels: one row a sample, role after role.

        Columns: role, time (s on the channel's clock), value (SI), unit, clock. Nothing is
        resampled. Raises InputError where pandas is not installed.
        """
        pandas = optional_library("pandas")
        columns = ["role", "time", "value", "unit", "clock"]
        parts = [
            pandas.DataFrame(
                {"role": c.role, "time": c.time, "value": c.value, "unit": c.unit, "clock": c.clock}
            )
            for c in self.channels.values()
        ]
        return (
            pandas.concat(parts, ignore_index=True) if parts else pandas.DataFrame(columns=columns)
        )

    def to_xarray(self) -> Any:
        """An xarray.Dataset of all channels, each over its own dimension `time_<role>` in s.

        Nothing is resampled; units are in the attributes. Raises InputError where xarray is not
        installed.
        """
        xarray = optional_library("xarray")
        arrays = {
            role: channel.to_xarray().rename({"time": f"time_{role}"})
            for role, channel in self.channels.items()
        }
        return xarray.Dataset(arrays, attrs={"recording": self.folder.name})

    def _repr_html_(self) -> str:
        counts = f"{self.duration:.3f} s, {self.frame_count} frames, {len(self.channels)} channels"
        rows = [(c.role, c.unit, c.time.size, c.clock, c.origin) for c in self.channels.values()]
        head = ("role", "unit", "samples", "clock", "origin")
        return card(
            f"Recording {self.folder.name}",
            [counts],
            table(head, rows),
            table(("not recorded", "reason"), self.missing.items()),
            table(
                ("message", "fault", "frames"), [(f.message, f.fault, f.count) for f in self.faults]
            ),
        )

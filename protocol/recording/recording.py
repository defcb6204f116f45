"""A recording is a folder: raw frames and a description, decoded afresh whenever it is read.

run.toml        what was done, by which versions, with which database; how late the ticks were
frames.log      every frame, candump text, append-only (absent where only tables were imported)
database.dbc    the database as it was (DBC; ARXML, KCD or SYM under this name as well)
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

from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.role_map import RoleMap
from slipbench.protocol.trial_file import TrialFile


@dataclass(frozen=True)
class BusFault:
    """Frames of one message that could not be taken at face value."""

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

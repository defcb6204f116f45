"""A role map binds the signals of one vehicle to roles, with unit, sign and clock."""

import difflib
import re
from typing import Literal

from pydantic import Field, field_validator, model_validator

from slipbench.protocol.configuration import Hertz, Metres, Seconds, Section
from slipbench.protocol.recording.message_rules import BusName, Degraded, MessageRules
from slipbench.protocol.recording.roles import ROLES
from slipbench.protocol.units import linear


class Source(Section):
    """Source of one role: a signal of the database, a tooth message, or a table column.

    signals       "Message.signal"; several are averaged (a left and a right wheel, say); they must
                  then belong to one message. A multiplexed signal is named like any other.
    teeth         "Message": a message of tooth intervals (protocol.codec.messages.ToothIntervals)
    anchor        "Message": with `teeth`, the encoder's status that anchors their times
    table         side table of `column`; empty: the table that stands in place of the log
    column        column of a table
    time_column   column with the times, if `column` has a clock of its own
    bus           only frames of this bus ("can0"); empty: any
    valid         "Message.signal" of the same message, or a column of the same table: samples count
                  only where it is not 0
    unknown       values, in the database's unit, that say "not known": no samples
    unit          unit of the signal, in place of the database's (or of the column)
    sign          value = sign * scale * SI(value) + offset
    scale         see sign
    offset        see sign; in the SI unit of the role
    values        of an enumeration: raw value -> name or number, as in { "2" = "throttle" }
    names         with `teeth`: signals that do not have the bench's names, as in
                  { tooth_count = "ToothCnt" }
    anchor_names  with `anchor`: the same
    clock         "bus": arrival times. A name: the device whose `time_signal` stamps the samples
    time_signal   "Message.signal" with the device's own time, wrapping at the signal's width
    delay         known latency, subtracted from the times
    radius        turns a wheel's angular speed into peripheral speed where the role's unit is m/s
    modulo        period of a counter that wraps
    """

    signals: tuple[str, ...] = ()
    teeth: str = ""
    anchor: str = ""
    table: str = ""
    column: str = ""
    time_column: str = ""
    bus: str = ""
    valid: str = ""
    unknown: tuple[float, ...] = ()
    unit: str | None = None
    sign: Literal[1, -1] = 1
    scale: float = Field(default=1.0, gt=0, allow_inf_nan=False)
    values: dict[str, str | int] = Field(default_factory=dict)
    names: dict[str, str] = Field(default_factory=dict)
    anchor_names: dict[str, str] = Field(default_factory=dict)
    offset: float = 0.0
    clock: str = "bus"
    time_signal: str = ""
    delay: Seconds = 0.0
    radius: Metres | None = Field(default=None, gt=0)
    modulo: int | None = Field(default=None, gt=1)

    @field_validator("values", mode="after")
    @classmethod
    def _whole_numbers(cls, values: dict[str, str | int]) -> dict[str, str | int]:
        for raw in values:
            if not re.fullmatch(r"-?(\d{1,18}|0x[0-9A-Fa-f]{1,15})", raw):
                raise ValueError(f'{raw!r} is no raw value; give a whole number, as in "2"')
        return values

    @model_validator(mode="after")
    def _one_source(self) -> "Source":
        given = [bool(self.signals), bool(self.teeth), bool(self.column)]
        if sum(given) != 1:
            raise ValueError('give exactly one of "signals", "teeth" or "column"')
        if bool(self.teeth) != bool(self.anchor):
            raise ValueError('"teeth" and "anchor" belong together')
        if (self.clock != "bus") != bool(self.time_signal or self.teeth):
            raise ValueError('"clock" and "time_signal" must be given together')
        return self


class TableRules(Section):
    """Rules for the times of one side table: [tables.gps] in the role map.

    time_column    column with the time of all others (else found by its name)
    time_unit      unit of that column where its name does not state it: "ms"
    sample_period  of a table without a time column
    align          "epoch": its times count from the same instant as the log's. "start": its first
                   row was taken when the log began. "auto": epoch, and refused where no overlap
    time_offset    added to the table's times: what its clock was behind
    clock          name of the clock that stamped it where that has nothing in common with the log's
    """

    time_column: str = ""
    time_unit: str = ""
    sample_period: Seconds | None = Field(default=None, gt=0)
    align: Literal["auto", "epoch", "start"] = "auto"
    time_offset: Seconds = 0.0
    clock: str = "bus"


class Geometry(Section):
    """Data of a vehicle that identification needs beside its channels.

    driven_axle     axle whose slip is analysed
    rear_radius     rolling radius of the rear wheel
    front_radius    rolling radius of the front wheel
    teeth_per_turn  of the wheel encoders
    """

    driven_axle: Literal["rear", "front", "both"] = "rear"
    rear_radius: Metres | None = None
    front_radius: Metres | None = None
    teeth_per_turn: int | None = None


class RoleMap(Section):
    """One role-map file. With the roles that the bench sends it is a binding file.

    title       text for people
    database    CAN database, a path relative to this file; empty: the one beside the recording
    bus         name of the bus of every message that names none, where there are several buses
    bitrate     of an imported capture's buses; without it no bus load is computed
    tables      rules for the times of side tables, by table
    quantities  role -> SI unit, of what is not a motorcycle's: `belt_speed = "V"`
    messages    by message: bus, cycle time, timeout and protection, where the database does not
                state them
    degraded    what the bus lacks, and what the bench does instead
    roles       source of each role
    """

    title: str
    database: str = ""
    vehicle: Geometry = Geometry()
    bus: BusName = ""
    bitrate: Hertz | None = Field(default=None, gt=0)
    tables: dict[str, TableRules] = Field(default_factory=dict)
    quantities: dict[str, str] = Field(default_factory=dict)
    messages: dict[str, MessageRules] = Field(default_factory=dict)
    degraded: Degraded = Degraded()
    roles: dict[str, Source]

    def unit(self, role: str) -> str:
        """SI unit of a role that this map binds."""
        return self.quantities[role] if role in self.quantities else ROLES[role].unit

    def bus_of(self, message: str) -> str:
        """Name of the bus of a message of the database; "" where the file names none."""
        rule = self.messages.get(message)
        return (rule.bus if rule else "") or self.bus

    @model_validator(mode="after")
    def _own_quantities(self) -> "RoleMap":
        for name, unit in self.quantities.items():
            if name in ROLES:
                raise ValueError(
                    f"quantities.{name}: slipbench has a role of this name, in"
                    f" {ROLES[name].unit}; leave the line out, or take another name"
                )
            try:
                linear(unit, unit)
            except ValueError as cause:
                raise ValueError(f"quantities.{name}: {cause}") from cause
        return self

    @model_validator(mode="after")
    def _known_roles(self) -> "RoleMap":
        for name in self.roles:
            if name not in ROLES and name not in self.quantities:
                near = difflib.get_close_matches(name, ROLES, n=1, cutoff=0.4)
                own = 'or state its unit under [quantities], as in belt_speed = "V"'
                meant = f"did you mean {near[0]!r}?" if near else "see protocol/recording/roles.py,"
                hint = f"{meant} {own}"
                raise ValueError(f"unknown role {name!r}; {hint}")
        return self

"""Samples of one role from a side table, on the time axis of the recording."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.bus_channels import Missing
from slipbench.protocol.recording.channel import Channel, FloatArray
from slipbench.protocol.recording.role_lookup import to_si
from slipbench.protocol.recording.role_map import RoleMap, Source, TableRules
from slipbench.protocol.tables import Samples, Table, samples

BUS = "bus"
MAIN = "main"  # name of the table that stands in place of a log


@dataclass(frozen=True)
class Span:
    """Times of the log's first and last frame, s since its epoch."""

    start: float
    end: float


@dataclass(frozen=True)
class TableLog:
    """All tables of a recording. span: of the log's frames, None where there are none."""

    tables: Mapping[str, Table]
    roles: RoleMap
    span: Span | None

    def start(self) -> float:
        """Start of a recording without frames: the earliest time in the tables, s."""
        times = [
            found.time[0] + self._rules(source).time_offset
            for source in self.roles.roles.values()
            if source.column and (source.table or MAIN) in self.tables
            if not self._lacking(source)
            if (found := self._read(source)).time.size
        ]
        return float(min(times, default=0.0))

    def channel(self, role: str, source: Source, start: float) -> tuple[Channel, tuple[str, ...]]:
        """Channel of one role, its times from `start` (s), and warnings. Raises Missing, InputError."""
        name = source.table or MAIN
        if name not in self.tables:
            what = "no table stands in place of the log" if name == MAIN else f"no table {name!r}"
            raise Missing(f"{what} was given (--table {name}=FILE)")
        if lacking := self._lacking(source):
            raise Missing(lacking)
        found = self._read(source)
        if source.valid:
            found = self._only_valid(found, source)
        if source.unknown:
            found = found.select(~np.isin(found.value, source.unknown))
        if not found.time.size:
            raise Missing(f"column {source.column!r} of table {name!r} holds no numbers")
        time = self._since(start, found, self._rules(source), name) - source.delay
        unit = self.roles.unit(role)
        value = to_si(found.value, found.unit, role, source, unit)
        origin = f"table {name}: {source.column}"
        clock = self._rules(source).clock
        return Channel(role, time, value, unit, clock, origin), found.warnings

    def _rules(self, source: Source) -> TableRules:
        return self.roles.tables.get(source.table or MAIN, TableRules())

    def _read(self, source: Source) -> Samples:
        table = self.tables[source.table or MAIN]
        return samples(table, source.column, source.time_column, self._rules(source))

    def _lacking(self, source: Source) -> str:
        """Reason why the table has no samples of a role: a missing column; empty if it has all."""
        for name in (source.column, source.valid):
            try:
                if name:
                    self.tables[source.table or MAIN].find(name)
            except InputError as cause:
                return f"{cause.what}; {cause.remedy}"
        return ""

    def _only_valid(self, found: Samples, source: Source) -> Samples:
        table = self.tables[source.table or MAIN]
        flag = samples(table, source.valid, source.time_column, self._rules(source))
        return found.select(np.isin(found.time, flag.time[flag.value != 0]))

    def _since(self, start: float, found: Samples, rules: TableRules, name: str) -> FloatArray:
        """Times of a table on the time axis of the recording, s."""
        if rules.clock != BUS:
            return found.time  # its time on the log's clock is unknown
        if rules.align == "start" or (self.span is not None and not found.clock):
            first: float = found.time[0] - rules.time_offset
            return found.time - first
        time: FloatArray = found.time + rules.time_offset
        if self.span is not None and rules.align == "auto":
            self._check_overlap(time, name)
        since: FloatArray = time - start
        return since

    def _check_overlap(self, time: FloatArray, name: str) -> None:
        assert self.span is not None
        if time[0] > self.span.end or time[-1] < self.span.start:
            raise InputError(
                "its times do not meet those of the log",
                where=f"table {name}",
                expected=f"some between {self.span.start:.3f} and {self.span.end:.3f} s",
                found=f"{time[0]:.3f} to {time[-1]:.3f} s",
                remedy=f'in the role map, under [tables.{name}], give time_offset = "... s", or'
                ' align = "start" if both began together',
            )

"""Two runs side by side: what differs in facts and tags, and in parameters beyond their intervals."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scipy import stats

from slipbench.identification.report.words import p_value
from slipbench.identification.season.entry import LEVEL
from slipbench.identification.season.listing import cell, heading
from slipbench.identification.season.numbers import with_interval
from slipbench.identification.season.season import Season
from slipbench.identification.season.tagging import one_called
from slipbench.identification.session.comparison import holm

SIGNIFICANT = 0.05
OWN = ("name", "path", "date", "reason", "fault", "session")  # differ in any two runs

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Difference:
    """A parameter in two runs, second minus first.

    low, high  95 % interval of the difference; None where a run has no interval
    p_value    of so large a difference by chance, corrected for the number of parameters (Holm)
    """

    parameter: str
    value: float
    low: float | None = None
    high: float | None = None
    p_value: float | None = None

    @property
    def words(self) -> str:
        """Whether the runs differ."""
        if self.p_value is None:
            return "no interval"
        verb = "differs" if self.p_value < SIGNIFICANT else "equal within intervals"
        return f"{verb} ({p_value(self.p_value)})"


def pair(season: Season, names: Sequence[str]) -> tuple[Row, Row]:
    """Rows of two runs by their names. Raises InputError for a name that is none, or of several."""
    rows = {row["path"]: row for row in reversed(season.rows("kind <> 'identify'"))}
    first, second = (rows[one_called(name, list(rows))] for name in names)
    return first, second


def differences(season: Season, first: Row, second: Row) -> list[Difference]:
    """Difference of each parameter that both runs have, tested against both intervals."""
    shared = [name for name in sorted(season.units) if None not in (first[name], second[name])]
    made = [_difference(name, first, second) for name in shared]
    known = [one.p_value for one in made if one.p_value is not None]
    adjusted = iter(holm(known))
    return [
        one
        if one.p_value is None
        else Difference(one.parameter, one.value, one.low, one.high, next(adjusted))
        for one in made
    ]


def _difference(name: str, first: Row, second: Row) -> Difference:
    value = second[name] - first[name]
    widths = [_half_width(name, row) for row in (first, second)]
    if None in widths:
        return Difference(name, value)
    half = math.hypot(*(width for width in widths if width is not None))
    p = float(2 * stats.norm.sf(abs(value) / half * LEVEL)) if half else float(value == 0)
    return Difference(name, value, value - half, value + half, p)


def _half_width(name: str, row: Row) -> float | None:
    low, high = row.get(f"{name}_low"), row.get(f"{name}_high")
    return None if low is None or high is None else (high - low) / 2


def table(season: Season, first: Row, second: Row) -> tuple[list[str], list[list[str]]]:
    """Headings and cells: facts and tags that differ, then every parameter of either run."""
    names = [
        str(row["name"]) if first["name"] != second["name"] else row["path"]
        for row in (first, second)
    ]
    tested = {one.parameter: one for one in differences(season, first, second)}
    facts = [
        name
        for name in season.plain_columns
        if name not in season.units and (name in OWN or first[name] != second[name])
    ]
    cells = [
        [name, cell(season, name, first), cell(season, name, second), "", ""]
        for name in facts
        if name not in ("name", "path") and (first[name] or second[name])
    ]
    for name in sorted(season.units):
        if first[name] is None and second[name] is None:
            continue
        one = tested.get(name)
        cells.append(
            [
                heading(season, name),
                cell(season, name, first),
                cell(season, name, second),
                with_interval(one.value, one.low, one.high) if one else "",
                one.words if one else "in one run only",
            ]
        )
    return ["", *names, "difference", ""], cells

"""A parameter over an abscissa: one point for each value of the abscissa, from all runs that have it."""

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from slipbench.identification.season.entry import LEVEL
from slipbench.identification.season.season import Season
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.channel import FloatArray

Row = Mapping[str, Any]
EPOCH = datetime(1970, 1, 1)
DATE, TIME = "date", "time"
ALIKE = ("vehicle", "trial", "actuator", "gear", "engine_speed")
FEWEST = 3  # points: a line needs two, its interval one more


@dataclass(frozen=True)
class Points:
    """Values of a parameter, its runs pooled where they have the same abscissa.

    parameter, unit   of value and deviation
    over              name of the abscissa: "date" in days, "time" in days with parts, or a tag
    x                 (n,), increasing
    value, deviation  (n,); deviation: standard deviation, 0 where the parameter has no intervals
    runs              (n,) names of the runs of each point
    left_out          why other runs are no part of it
    mixed             facts in which the runs differ, so that a change may be one of these
    """

    parameter: str
    unit: str
    over: str
    x: FloatArray
    value: FloatArray
    deviation: FloatArray
    runs: tuple[str, ...]
    left_out: tuple[str, ...]
    mixed: tuple[str, ...] = ()

    def place(self, at: int) -> str:
        """Abscissa of a point as text."""
        return abscissa_text(self.over, float(self.x[at]))


def abscissa_text(over: str, x: float) -> str:
    """Abscissa as text. x: in days since 1970 for a date and a time, else in the unit of the tag"""
    if over not in (DATE, TIME):
        return f"{over} {x:.6g}"
    moment = EPOCH + timedelta(days=x)
    return moment.date().isoformat() if over == DATE else moment.isoformat(" ", "minutes")


def points(season: Season, parameter: str, over: str = DATE, where: str | None = None) -> Points:
    """Points of a parameter of the runs for which `where` holds.

    over: "date": runs of a day are pooled; "time": each run by itself; else a tag or another number.
    Raises InputError for a name that is none, or where fewer than three points are found.
    """
    name, abscissa = _parameter(season, parameter), _abscissa(season, over)
    rows = season.rows(where)
    having = [row for row in rows if row[name] is not None]
    sources = {row["kind"] for row in having}
    used, left_out = having, []
    for words, keep in (
        ("an identification beside that of its run", _primary(sources)),
        ("verdict: not usable", lambda row: row["verdict"] != "not usable"),
        (f"no {over}", lambda row: row[abscissa] is not None),
        ("no interval", _with_interval(name, having)),
    ):
        lacking = [_label(row) for row in used if not keep(row)]
        used = [row for row in used if keep(row)]
        left_out += [f"{words}: {', '.join(lacking)}"] if lacking else []
    made = _pooled(used, name, over, abscissa)
    if len(made) < FEWEST:
        raise InputError(
            f"too few values of {name} over {over} for a trend",
            expected=f"at least {FEWEST} different values of {over}",
            found="; ".join([f"{len(made)} of {len(used)} runs", *left_out]),
            remedy="tag the runs, choose another --over, or widen --where",
        )
    x, value, deviation = np.array([one[:3] for one in made]).T
    names = tuple(one[3] for one in made)
    mixed = tuple(_mixed(used, fact) for fact in ALIKE if _mixed(used, fact))
    return Points(name, season.units[name], over, x, value, deviation, names, (*left_out,), mixed)


def _label(row: Row) -> str:
    """Name of a run with its session."""
    return f"{row['session']}/{row['name']}" if row["session"] else str(row["name"])


def _mixed(rows: Sequence[Row], fact: str) -> str:
    """A fact with its values, where they differ."""
    values = sorted({str(row[fact]) for row in rows if row[fact] not in (None, "")})
    return f"{fact} ({', '.join(values)})" if len(values) > 1 else ""


def _primary(kinds: set[str]) -> Any:
    """Which rows count: an `identify` of its own only where no run has the parameter."""
    return lambda row: row["kind"] != "identify" or "run" not in kinds


def _with_interval(name: str, rows: Sequence[Row]) -> Any:
    """Which rows count: those with an interval, unless none has one."""
    known = [row for row in rows if _deviation(row, name)]
    return (lambda row: bool(_deviation(row, name))) if known else (lambda row: True)


def _deviation(row: Row, name: str) -> float:
    low, high = row.get(f"{name}_low"), row.get(f"{name}_high")
    return 0.0 if low is None or high is None else max((high - low) / (2 * LEVEL), 0.0)


def _pooled(
    rows: Sequence[Row], name: str, over: str, abscissa: str
) -> list[tuple[float, float, float, str]]:
    """x, weighted mean, its deviation, and the runs, for each x in increasing order."""
    groups: dict[float, list[Row]] = {}
    for row in rows:
        groups.setdefault(_x(row[abscissa], over), []).append(row)
    made = []
    for x, group in sorted(groups.items()):
        values = np.array([row[name] for row in group])
        deviations = np.array([_deviation(row, name) for row in group])
        weights = 1 / deviations**2 if deviations.all() else np.ones(values.size)
        deviation = float(weights.sum() ** -0.5) if deviations.all() else 0.0
        names = ", ".join(sorted({_label(row) for row in group}))
        made.append((x, float(np.average(values, weights=weights)), deviation, names))
    return made


def _x(value: Any, over: str) -> float:
    if not isinstance(value, datetime):
        return float(value)
    days = (value - EPOCH) / timedelta(days=1)
    return float(np.floor(days)) if over == DATE else days


def _parameter(season: Season, name: str) -> str:
    """Name of a parameter; the only one that begins with it will do. Raises InputError."""
    if name in season.units:
        return name
    begun = [one for one in season.units if one.startswith(f"{name}_")]
    if len(begun) == 1:
        return begun[0]
    near = begun or difflib.get_close_matches(name, season.units, n=3, cutoff=0.4)
    known = ", ".join(sorted(season.units)) or "none: identify or explain the runs first"
    raise InputError(
        f"there is no parameter {name!r}",
        where="--trend",
        remedy=f"did you mean {' or '.join(near)}?" if near else f"parameters: {known}",
    )


def _abscissa(season: Season, over: str) -> str:
    """Column of an abscissa. Raises InputError where it is none, or has no numbers."""
    column = DATE if over == TIME else over
    numeric = season.numeric
    if column in numeric:
        return column
    near = difflib.get_close_matches(over, [*numeric, TIME], n=1, cutoff=0.4)
    what = "holds no numbers" if column in season.columns else "is no column"
    raise InputError(
        f"{over} {what}",
        where="--over",
        remedy=f"did you mean {near[0]!r}?" if near else f"numbers: {', '.join([*numeric, TIME])}",
    )

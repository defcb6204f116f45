"""The list of runs: which columns it shows, and the text of each cell."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

from slipbench.identification.season.numbers import with_interval
from slipbench.identification.season.season import Season

FIRST = ("name", "kind", "session", "date", "actuator", "excitation", "amplitude", "verdict")
SHOWN = ("natural_frequency", "damping_ratio", "dead_time", "resonance")  # where a run has them
Row = Mapping[str, Any]
Listing = tuple[list[str], list[list[str]]]


def listing(season: Season, where: str | None = None) -> Listing:
    """Headings and cells of the usual columns, newest first. Raises InputError for a wrong filter.

    Facts, tags, parameters of the main model, and every parameter of an `explain`; a column that is
    empty, or is "run" everywhere, is left out, and the vehicle where it is one and the same.
    """
    rows = season.rows(where)
    effects = {
        p.name for one in season.entries if one.folder.kind == "explain" for p in one.parameters
    }
    several = ["vehicle"] if len({row["vehicle"] for row in rows}) > 1 else []
    names = [*FIRST, *several, *season.tags, *SHOWN, *sorted(effects)]
    kept = [
        name for name in names if any(row.get(name) not in (None, "", "run") for row in rows)
    ] or ["name"]
    return [heading(season, name) for name in kept], [
        [cell(season, name, row) for name in kept] for row in rows
    ]


def selected(season: Season, columns: str, where: str | None = None) -> Listing:
    """Headings and cells of SQL expressions, newest first; a parameter with its interval.

    Raises InputError where they are none.
    """
    names, _ = season.projected(columns, where)
    plain = {part.strip() for part in columns.split(",")} & season.units.keys()
    bounds = [f"{n}_{end}" for n in plain for end in ("low", "high")]
    beside = [one for one in bounds if one in season.columns and one not in names]
    made, rows = season.projected(", ".join([columns, *beside]), where)
    found = [dict(zip(made, row, strict=True)) for row in rows]
    return [heading(season, name) for name in names], [
        [cell(season, name, row) for name in names] for row in found
    ]


def heading(season: Season, name: str) -> str:
    """Name of a column, with the unit of a parameter."""
    unit = season.units.get(name, "")
    return f"{name}, {unit}" if unit not in ("", "1", "SI") else name


def cell(season: Season, name: str, row: Row) -> str:
    """Text of one cell; a parameter with its interval where the row has that."""
    value = row[name]
    if value is None:
        return ""
    if isinstance(value, datetime):
        return value.isoformat(" ", "minutes")
    if isinstance(value, float) and name not in season.units:
        return f"{value:.10g}"
    if isinstance(value, float):
        return with_interval(value, row.get(f"{name}_low"), row.get(f"{name}_high"))
    return str(value)


def faults(season: Season, rows: Sequence[Row]) -> list[str]:
    """A line for each run with a fault, and for each tag whose values do not go together."""
    made = [f"{row['path']}: {row['fault']}" for row in rows if row["fault"]]
    made += [
        f"tag {name} is a number in some runs and a text in others: its column is a text"
        for name in season.mixed
    ]
    return made

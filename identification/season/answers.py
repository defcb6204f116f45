"""Queries of the page of a season: rows, two runs side by side, a trend; as JSON can hold it.

The index is brought up to date with every list of rows, so that a run that was recorded meanwhile is
in it.
"""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from slipbench.identification.season.index import refreshed
from slipbench.identification.season.listing import faults, listing, selected
from slipbench.identification.season.points import TIME, points
from slipbench.identification.season.season import Season
from slipbench.identification.season.side_by_side import pair, table
from slipbench.identification.season.trend import Trend, curve, trend
from slipbench.identification.season.trend_words import lines
from slipbench.protocol.errors import InputError

Parameters = Mapping[str, str]


class SeasonAnswers:
    """Queries about the runs below a folder."""

    def __init__(self, root: Path) -> None:
        """Read the season. Raises InputError where the folder or a library is missing."""
        self._root = root
        self._season = Season(refreshed(root))

    @property
    def by_name(self) -> dict[str, Callable[[Parameters], dict[str, Any]]]:
        """The queries by the names that the page uses."""
        return {"rows": self.rows, "compare": self.compare, "trend": self.trend}

    def rows(self, query: Parameters) -> dict[str, Any]:
        """Table of runs. query: where and columns, SQL as in `slipbench runs`. Raises InputError."""
        season = self._season = Season(refreshed(self._root))
        where, columns = query.get("where") or None, query.get("columns") or None
        found = season.rows(where)
        headings, cells = selected(season, columns, where) if columns else listing(season, where)
        return {
            "folder": self._root.name,
            "total": len(season.entries),
            "headings": headings,
            "cells": cells,
            "runs": [row["path"] if row["kind"] != "identify" else None for row in found],
            "faults": faults(season, found),
            "columns": season.plain_columns,
            "parameters": sorted(season.units),
            "abscissae": [*season.numeric, TIME],
        }

    def compare(self, query: Parameters) -> dict[str, Any]:
        """Two runs side by side. query: first and second, paths of runs. Raises InputError."""
        names = [query.get("first", ""), query.get("second", "")]
        if not all(names):
            raise InputError("two runs are compared", expected="first and second")
        headings, cells = table(self._season, *pair(self._season, names))
        return {"headings": headings, "cells": cells}

    def trend(self, query: Parameters) -> dict[str, Any]:
        """Trend of a parameter. query: parameter, over, where. Raises InputError."""
        found = trend(
            points(
                self._season,
                query.get("parameter", ""),
                query.get("over") or "date",
                query.get("where") or None,
            )
        )
        return _drawn(found) | {"lines": lines(found)}


def _drawn(found: Trend) -> dict[str, Any]:
    """Points with their 95 % intervals, and the line with its own; null where there is none."""
    of = found.points
    half = 1.96 * of.deviation
    drawn = curve(found).T
    columns = {
        "x": of.x,
        "value": of.value,
        "low": of.value - half,
        "high": of.value + half,
        "line": drawn[0],
        "line_low": drawn[1],
        "line_high": drawn[2],
    }
    return {
        "parameter": of.parameter,
        "unit": of.unit if of.unit not in ("1", "SI") else "",
        "over": of.over,
        "places": [of.place(i) for i in range(of.x.size)],
        "runs": list(of.runs),
        "changes": [one.after for one in found.changes],
    } | {name: [x if math.isfinite(x) else None for x in v.tolist()] for name, v in columns.items()}

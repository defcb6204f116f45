"""The report of a session: written from its folder."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

from slipbench.session_evidence import lines_for_report
from slipbench.session_explain import MEMO, Say, explained, runs_of

if TYPE_CHECKING:  # the analyses take seconds to import; --help should not
    from slipbench.bench.session.session import Session
    from slipbench.identification.session.day import Day


def write_report(session: "Session", vehicle: Path | None, say: Say) -> Path:
    """Path of report.html; also writes session.json. vehicle: of the nominal simulation, or None."""
    from slipbench.bench.session.session_folder import write_whole
    from slipbench.identification.session.day import figures, results
    from slipbench.identification.session.page import page

    day = _day(session, vehicle, say)
    found = results(day)
    write_whole(session.folder / "session.json", json.dumps(figures(day, found), indent=1) + "\n")
    path = session.folder / "report.html"
    write_whole(path, page(day, found))
    return path


def _day(session: "Session", vehicle: Path | None, say: Say) -> "Day":
    from slipbench.identification.session.day import Day
    from slipbench.identification.session.selection import selection

    runs = runs_of(session)
    incomplete = sorted(path.name for path in (session.folder / "runs").glob("*-incomplete-*"))
    verdict, why_not = (None, "") if vehicle is None else explained(session, vehicle, say)
    return Day(
        session.plan.name,
        session.plan.description,
        len(session.runs),
        runs,
        tuple(incomplete),
        verdict,
        why_not,
        f"{MEMO}/memo.html" if verdict is not None else "",
        selection(runs).lines if verdict is not None else (),
        lines_for_report(session),
    )

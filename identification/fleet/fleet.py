"""Run every analysis of a fleet in parallel, and write one table of all verdicts."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from slipbench.identification.cluster import Workers, done_by
from slipbench.identification.fleet.fleet_file import Entry
from slipbench.identification.mismatch.explain import run_analysis
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.memo import sentence
from slipbench.identification.mismatch.reporting.output import with_training, write_outputs
from slipbench.identification.mismatch.reporting.verdict import as_tree
from slipbench.identification.mismatch.runs import open_analysis
from slipbench.protocol.errors import InputError

TABLE, VERDICT = "fleet.md", "verdict.json"
Row = dict[str, Any]


def explain_fleet(
    entries: Sequence[Entry],
    out: Path,
    workers: Workers,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> list[Row]:
    """Run the analyses without a verdict in `out` yet, and write the table of all.

    Every analysis writes its verdict, memo and improved vehicle file into a folder of its name.
    Invalid input is reported in the row of the analysis. progress: number done, and total.
    """
    out.mkdir(parents=True, exist_ok=True)
    rows = {e.name: row for e in entries if (row := _there(out / e.name)) is not None}
    progress(len(rows), len(entries))
    pending = {e.name: (e, str(out / e.name)) for e in entries if e.name not in rows}
    for name, row in done_by(workers, explain_one, pending) if pending else ():
        rows[name] = row
        progress(len(rows), len(entries))
    ordered = [{"name": e.name, **rows[e.name]} for e in entries]
    (out / TABLE).write_text(table(ordered), encoding="utf-8")
    return ordered


def explain_one(entry: Entry, folder: str) -> Row:
    """Row of one analysis, which is written into a folder of its own."""
    place = Path(folder)
    try:
        analysis = open_analysis(
            Path(entry.vehicle), [*map(Path, entry.training)], [*map(Path, entry.held_out)]
        )
        run_analysis(analysis)
    except InputError as fault:
        return {"trouble": str(fault)}
    found = with_training(verdict(analysis), [*map(Path, entry.training)], place)
    place.mkdir(parents=True, exist_ok=True)
    write_outputs(analysis, found, Path(entry.vehicle), None, place)
    tree = {**as_tree(found), "sentence": sentence(found)}
    draft = place / (VERDICT + ".part")
    draft.write_text(json.dumps(tree, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    draft.replace(place / VERDICT)  # the verdict comes last: with it, all is there
    return _row(tree)


def _there(folder: Path) -> Row | None:
    path = folder / VERDICT
    return _row(json.loads(path.read_text(encoding="utf-8"))) if path.exists() else None


def _row(tree: Mapping[str, Any]) -> Row:
    if tree.get("failure"):
        return {"trouble": f"the analysis failed in {tree['failure']}"}
    return {
        "mismatch": tree["mismatch"]["found"],
        "sentence": tree["sentence"],
        "effects": [
            f"{e['name']}.{e['subject']}" if e["subject"] else e["name"] for e in tree["effects"]
        ],
        "unknown": tree["unknown"]["found"],
    }


def table(rows: Sequence[Row]) -> str:
    """Table of all verdicts as Markdown."""
    text = ["| analysis | mismatch | missing effects | result |", "|---|---|---|---|"]
    for row in rows:
        if "trouble" in row:
            text.append(f"| {row['name']} | not analysed | | {_cell(row['trouble'])} |")
            continue
        named = ", ".join(row["effects"]) or ("unknown effect" if row["unknown"] else "")
        mismatch = "yes" if row["mismatch"] else "no"
        text.append(f"| {row['name']} | {mismatch} | {named} | {_cell(row['sentence'])} |")
    return "\n".join(text) + "\n"


def _cell(text: str) -> str:
    """A text as one cell of a table: one line, no bars."""
    return "; ".join(line.strip() for line in text.splitlines()).replace("|", r"\|")

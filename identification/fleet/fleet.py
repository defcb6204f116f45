"""Every analysis of a fleet, on as many workers as there are, and one table of all verdicts."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from slipbench.identification.cluster import Workers, done_by
from slipbench.identification.fleet.fleet_file import Entry
from slipbench.identification.mismatch.explain import known_so_far
from slipbench.identification.mismatch.runs import open_analysis
from slipbench.identification.mismatch.telling.conclude import verdict
from slipbench.identification.mismatch.telling.memo import sentence
from slipbench.identification.mismatch.telling.output import write_outputs
from slipbench.identification.mismatch.telling.verdict import as_tree
from slipbench.protocol.errors import InputError

TABLE, VERDICT = "fleet.md", "verdict.json"
Row = dict[str, Any]


def explain_fleet(
    entries: Sequence[Entry],
    out: Path,
    workers: Workers,
    told: Callable[[int, int], None] = lambda *_: None,
) -> list[Row]:
    """Analyse what has no verdict in `out` yet, and write the table of all.

    Every analysis leaves its verdict, its memo and its improved vehicle file in a folder of its
    name. One whose input is wrong says so in its row. told: how many are done, of how many.
    """
    out.mkdir(parents=True, exist_ok=True)
    rows = {e.name: row for e in entries if (row := _there(out / e.name)) is not None}
    told(len(rows), len(entries))
    left = {e.name: (e, str(out / e.name)) for e in entries if e.name not in rows}
    for name, row in done_by(workers, explain_one, left) if left else ():
        rows[name] = row
        told(len(rows), len(entries))
    ordered = [{"name": e.name, **rows[e.name]} for e in entries]
    (out / TABLE).write_text(table(ordered), encoding="utf-8")
    return ordered


def explain_one(entry: Entry, folder: str) -> Row:
    """Do one analysis into a folder of its own; returns its row."""
    place = Path(folder)
    try:
        analysis = open_analysis(
            Path(entry.vehicle), [*map(Path, entry.training)], [*map(Path, entry.held_out)]
        )
        known_so_far(analysis)
    except InputError as fault:
        return {"trouble": str(fault)}
    found = verdict(analysis)
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
    """Return the table of all verdicts as Markdown."""
    text = ["| analysis | mismatch | missing | in a sentence |", "|---|---|---|---|"]
    for row in rows:
        if "trouble" in row:
            text.append(f"| {row['name']} | not judged | | {_cell(row['trouble'])} |")
            continue
        named = ", ".join(row["effects"]) or ("no name for it" if row["unknown"] else "")
        mismatch = "yes" if row["mismatch"] else "no"
        text.append(f"| {row['name']} | {mismatch} | {named} | {_cell(row['sentence'])} |")
    return "\n".join(text) + "\n"


def _cell(text: str) -> str:
    """Return a text as one cell of a table: one line, no bars."""
    return "; ".join(line.strip() for line in text.splitlines()).replace("|", r"\|")

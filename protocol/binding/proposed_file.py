"""Write a proposed binding, and list it in short."""

import os
from pathlib import Path

from slipbench.protocol.binding.binding_text import binding_text
from slipbench.protocol.binding.capture import read_capture
from slipbench.protocol.binding.propose import Proposal, propose
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import Progress, quiet
from slipbench.protocol.new_file import new_file, refuse_existing


def propose_file(
    database: Path, log: Path | None, out: Path, title: str = "", progress: Progress = quiet
) -> Proposal:
    """Proposal for a database, written to the new file `out`.

    Raises InputError where the database, the capture or `out` cannot be used, and where the capture
    holds no message of the database.
    """
    refuse_existing(out)
    known = load_database(database)
    capture = read_capture(log, known, progress) if log else None
    if capture is not None and not capture.traffic:
        raise InputError(
            "the capture holds no message of the database",
            where=str(log),
            expected=f"some of the {len(known.messages)} messages of {database.name}",
            found=", ".join(map(hex, list(capture.log.unknown_identifiers())[:8])),
            remedy="give the database of this motorcycle, or a capture of this bus",
        )
    proposal = propose(known, capture)
    relative = os.path.relpath(database.resolve(), out.resolve().parent)
    text = binding_text(proposal, title or out.stem, Path(relative).as_posix())
    with new_file(out) as draft:
        draft.write_text(text, encoding="utf-8")
    return proposal


def table(proposal: Proposal) -> str:
    """One line for each role: signal, unit and score."""
    rows = [(f"{each.wheel}_teeth", each.teeth, "", "by layout") for each in proposal.teeth]
    for chosen in proposal.roles:
        if chosen.best is not None:
            found = chosen.best
            note = f"{found.score:.2f}" + (" (others are close)" if chosen.is_close else "")
            rows.append((chosen.role, found.name, found.signal.unit or "-", note))
    widths = [max((len(row[column]) for row in rows), default=0) for column in range(3)]
    lines = [
        "  ".join([*(c.ljust(w) for c, w in zip(row, widths, strict=False)), row[3]])
        for row in rows
    ]
    return "\n".join(lines) or "no signal suits a role"

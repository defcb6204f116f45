"""Write a proposed role map for a log, and report it with the next command."""

import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from slipbench.protocol.binding.proposed_file import propose_file, table
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import Progress, quiet, unknown_format
from slipbench.protocol.logs.formats import looks_like, read_head
from slipbench.protocol.new_file import new_file, refuse_existing
from slipbench.protocol.role_proposal.columns import columns_of
from slipbench.protocol.role_proposal.proposal import RoleProposal, propose_roles
from slipbench.protocol.role_proposal.role_map_text import role_map_text
from slipbench.protocol.tables import is_table, read_table


@dataclass(frozen=True)
class RoleRequest:
    """What to propose roles for. database: of a log of frames. title: "" for the name of `out`."""

    log: Path
    out: Path
    database: Path | None = None
    title: str = ""


def write_role_map(request: RoleRequest, progress: Progress = quiet) -> str:
    """Write the proposed role map to the new file `out`; returns the report for the terminal.

    Raises InputError where the log, the database or `out` cannot be used.
    """
    refuse_existing(request.out)
    if not is_table(request.log):
        return _of_frames(request, progress)
    proposal = propose_roles(columns_of(read_table(request.log)))
    text = role_map_text(proposal, request.log, request.title or request.out.stem)
    with new_file(request.out) as draft:
        draft.write_text(text, encoding="utf-8")
    return "\n".join([*_report(proposal), *_next(request, len(proposal.bound), _to_do(proposal))])


def _of_frames(request: RoleRequest, progress: Progress) -> str:
    if looks_like(read_head(request.log)) is None:
        raise unknown_format(request.log)
    if request.database is None:
        raise InputError(
            "frames cannot be decoded without a database",
            where=str(request.log),
            remedy="give the vehicle's DBC file with --dbc",
        )
    proposal = propose_file(request.database, request.log, request.out, request.title, progress)
    return "\n".join([table(proposal), *_next(request, len(proposal.bound), [])])


def _report(proposal: RoleProposal) -> Iterator[str]:
    """Layout of the table as read, and each column with its role."""
    yield from proposal.columns.table.layout
    if proposal.columns.time_column:
        yield f"times: column {proposal.columns.time_column!r}"
    elif not proposal.columns.table.clocks:
        yield "times: no column of times was found"
    yield ""
    rows = []
    for role, chosen in {**proposal.bound, **proposal.unresolved}.items():
        doubt = "" if role in proposal.bound else "UNRESOLVED: "
        close = "another column is close; " if not doubt and proposal.is_close(role) else ""
        unit = chosen.verdict.unit or "?"
        rows.append(
            (
                role,
                chosen.column.name,
                unit,
                f"{chosen.score:.2f}",
                doubt + close + chosen.verdict.reason,
            )
        )
    yield from _aligned(rows) if rows else ("no column suits a role",)
    yield ""
    if proposal.free:
        yield "without a role: " + ", ".join(column.name for column in proposal.free)
    if proposal.columns.unread:
        yield "no numbers: " + ", ".join(proposal.columns.unread)
    for warning in proposal.columns.warnings:
        yield f"warning: {warning}"


def _aligned(rows: Sequence[tuple[str, ...]]) -> Iterator[str]:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]) - 1)]
    for row in rows:
        cells = [cell.ljust(width) for cell, width in zip(row, widths, strict=False)]
        yield "  ".join([*cells, row[-1]])


def _to_do(proposal: RoleProposal) -> list[str]:
    """What the user must state before the file can be imported."""
    columns = proposal.columns
    timed = columns.time_column or columns.table.clocks
    return [
        *([] if proposal.bound else ["bind columns to roles"]),
        *([] if timed else ["state sample_period or time_column under [tables.main]"]),
    ]


def _next(request: RoleRequest, bound: int, to_do: list[str]) -> Iterator[str]:
    command = ["slipbench", "import", str(request.log)]
    if request.database:
        command += ["--dbc", str(request.database)]
    command += ["--roles", str(request.out), "--out", f"runs/{request.log.stem}"]
    yield f"{bound} roles proposed in {request.out}; read it and confirm them"
    if to_do:
        yield f"first: in {request.out} {'; '.join(to_do)}"
    yield f"{'then' if to_do else 'next'}: {shlex.join(command)}"

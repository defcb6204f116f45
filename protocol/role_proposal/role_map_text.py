"""A proposed role map as a TOML file with comments, which the user confirms by editing it."""

from collections.abc import Iterator
from pathlib import Path

from slipbench.protocol.binding.binding_text import quoted, wrapped
from slipbench.protocol.role_proposal.plausible import needs_radius, usual_units
from slipbench.protocol.role_proposal.proposal import Candidate, RoleProposal

LISTED = 60  # columns without a role


def role_map_text(proposal: RoleProposal, log: Path, title: str) -> str:
    """Text of the role map."""
    parts = (_head(proposal, log, title), _times(proposal), _roles(proposal), _rest(proposal))
    return "\n".join([*(line for part in parts for line in part), ""])


def _head(proposal: RoleProposal, log: Path, title: str) -> Iterator[str]:
    yield from wrapped(f"Proposed by slipbench roles from {log.name}.")
    yield "# Every entry is a proposal: confirm it, or replace it by another column."
    yield "# Scores are 0 to 1; they are no probabilities."
    for line in proposal.columns.table.layout:
        yield from wrapped(f"Read as: {line}")
    for warning in proposal.columns.warnings:
        yield from wrapped(f"CHECK: {warning}")
    yield f"title = {quoted(title)}"
    yield ""
    yield "# The axle whose slip is analysed; of a car state it."
    yield "# [vehicle]"
    yield '# driven_axle = "rear"'


def _times(proposal: RoleProposal) -> Iterator[str]:
    columns = proposal.columns
    if columns.time_column:
        unit = columns.table.units.get(columns.time_column, "")
        yield ""
        yield from wrapped(
            "Times: " + (f"unit {unit}, as stated." if unit else "by name and size of the numbers.")
        )
        yield "[tables.main]"
        yield f"time_column = {quoted(columns.time_column)}"
    elif not columns.table.clocks:
        yield ""
        yield "# No column of times was found. State the column, or the time between two rows:"
        yield "# [tables.main]"
        yield '# time_column = "..."'
        yield '# sample_period = "10 ms"'


def _roles(proposal: RoleProposal) -> Iterator[str]:
    if not proposal.bound:
        yield ""
        yield "# No column suits a role well enough. Remove this line, and bind some:"
        yield "[roles]"
    for role, chosen in proposal.bound.items():
        yield from _role(proposal, role, chosen, "")
    for role, chosen in proposal.unresolved.items():
        yield from _role(proposal, role, chosen, "# ")


def _role(proposal: RoleProposal, role: str, chosen: Candidate, mark: str) -> Iterator[str]:
    yield ""
    close = "; CHECK: another column is close" if not mark and proposal.is_close(role) else ""
    yield from wrapped(f"{chosen.score:.2f}: {', '.join(chosen.reasons)}{close}")
    yield from wrapped(chosen.column.describe())
    if others := proposal.others.get(role):
        listed = (
            f"{each.column.name} [{each.column.unit or '-'}] {each.score:.2f}" for each in others
        )
        yield from wrapped("others: " + ", ".join(listed))
    if mark:
        yield from wrapped(f"Not bound yet: {_to_do(chosen)}, then remove the number signs.")
    yield f"{mark}[roles.{role}]"
    yield f"{mark}column = {quoted(chosen.column.name)}"
    yield from (mark + line for line in _unit(chosen))
    if needs_radius(role, chosen.column.unit):
        yield f'{mark}radius = "0.3 m" # measure the rolling radius'


def _unit(chosen: Candidate) -> Iterator[str]:
    verdict = chosen.verdict
    if (verdict.stated and verdict.plausible) or (verdict.unit == "1" and not chosen.column.unit):
        return
    check = " # CHECK: found by the values" if verdict.unit else f" # {' or '.join(_units(chosen))}"
    yield f"unit = {quoted(verdict.unit or _units(chosen)[0])}{check}"


def _to_do(chosen: Candidate) -> str:
    if needs_radius(chosen.role, chosen.column.unit):
        return "state the radius"
    return "choose the unit" if chosen.verdict.plausible else "check column and unit"


def _units(chosen: Candidate) -> tuple[str, ...]:
    return chosen.verdict.candidates or usual_units(chosen.role)


def _rest(proposal: RoleProposal) -> Iterator[str]:
    if proposal.free:
        yield ""
        yield "# Columns without a role. Own quantities need their unit under [quantities]:"
    for column in proposal.free[:LISTED]:
        yield from wrapped(column.describe())
    if len(proposal.free) > LISTED:
        yield f"# and {len(proposal.free) - LISTED} more"
    if proposal.columns.unread:
        yield ""
        yield "# Columns that hold no numbers:"
    for name, reason in proposal.columns.unread.items():
        yield from wrapped(f"{name}: {reason}")

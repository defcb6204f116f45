"""What `slipbench check` reports: roles, contradictions, and what is missing for a trial."""

from collections.abc import Iterator
from dataclasses import dataclass

from slipbench.bench.check.findings import Finding, findings
from slipbench.bench.check.observed_roles import RoleStatus, observed_roles, roles_of
from slipbench.bench.check.traffic import BusTraffic
from slipbench.protocol.binding.binding import Binding
from slipbench.protocol.binding.match import nearest
from slipbench.protocol.binding.missing import Need, missing_roles

NOTHING_RECEIVED = 2
NOT_LIVE = 3
MOST_UNKNOWN = 8  # identifiers that are listed


@dataclass(frozen=True)
class CheckReport:
    """One check. unknown: identifiers that the database does not have, with the number of frames."""

    binding: Binding
    roles: tuple[RoleStatus, ...]
    findings: tuple[Finding, ...]
    missing: tuple[Need, ...]
    unknown: dict[int, int]
    frames: int
    duration: float

    @property
    def status(self) -> int:
        """Exit status: 0, 2 where nothing came, 3 where a role is not live or something contradicts."""
        if all(each.age is None for each in self.roles):
            return NOTHING_RECEIVED
        return NOT_LIVE if self.findings or not all(each.is_live for each in self.roles) else 0


def check_report(binding: Binding, traffic: BusTraffic) -> CheckReport:
    """Report on what was received."""
    roles = observed_roles(binding, traffic)
    received = any(each.age is not None for each in roles)
    return CheckReport(
        binding,
        tuple(roles),
        tuple(findings(binding, traffic)) if received else (),
        tuple(missing_roles(roles_of(binding), spark=True)),
        dict(traffic.sorted.unknown_identifiers()),
        len(traffic.log),
        traffic.duration,
    )


def table(roles: tuple[RoleStatus, ...] | list[RoleStatus]) -> str:
    """One line for each role: state, value, age, rate and faults."""
    rows = [("role", "state", "value", "age", "rate", "faults", "signal"), *map(_row, roles)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )


def _row(status: RoleStatus) -> tuple[str, ...]:
    faults = ", ".join(f"{fault} {count}" for fault, count in (status.faults or {}).items())
    age = "" if status.age is None else _time(status.age)
    rate = f"{status.rate:.4g} Hz" if status.rate else ""
    return status.role, status.state, status.value, age, rate, faults, status.signals


def _time(seconds: float) -> str:
    return f"{seconds * 1e3:.0f} ms" if seconds < 1 else f"{seconds:.1f} s"


def summary(report: CheckReport) -> str:
    """The report as text."""
    return "\n".join(_lines(report))


def _lines(report: CheckReport) -> Iterator[str]:
    yield table(report.roles)
    yield f"{report.frames} frames in {report.duration:.1f} s"
    if report.status == NOTHING_RECEIVED:
        known = ", ".join(map(hex, list(report.unknown)[:MOST_UNKNOWN]))
        beside = f"; frames of other identifiers: {known}" if known else ""
        yield (
            f"nothing was received of this binding{beside}. Is it the right bus, bit rate and"
            " database, and is the ignition on?"
        )
    dead = [each.role for each in report.roles if not each.is_live]
    if dead:
        yield f"not live: {', '.join(dead)}"
    for finding in report.findings:
        yield str(finding)
    yield from _missing(report)


def _missing(report: CheckReport) -> Iterator[str]:
    if not report.missing:
        yield "nothing is missing for a trial"
        return
    yield "missing for a trial (listening needs none of these):"
    for need in report.missing:
        near = nearest(report.binding.database, need.role)
        instead = f"; or accept it under [degraded]: {need.instead}" if need.instead else ""
        yield f"  {need.role}: without it {need.without}; nearest: {near}{instead}"

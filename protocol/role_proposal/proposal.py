"""Roles proposed for the columns of a table: by name, by unit, and by what the values can be."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slipbench.protocol.binding.behaviour import SPEED_ROLES
from slipbench.protocol.binding.gear_ratios import correlation, stepped
from slipbench.protocol.binding.match import LEAST, NEEDED, OWN_STATUS, REQUESTS, match
from slipbench.protocol.database.layout import Message, Signal
from slipbench.protocol.recording.roles import ROLES
from slipbench.protocol.role_proposal.columns import Column, Columns, on_base
from slipbench.protocol.role_proposal.plausible import UnitVerdict, unit_verdict
from slipbench.protocol.tables.titles import without_unit
from slipbench.protocol.units import converts, linear

FloatArray = npt.NDArray[np.float64]

ALIKE = 0.25  # score from which a column is named beside another
CLOSE = 0.05  # difference of scores from which the second is named as close
IMPLAUSIBLE = 0.4  # lost where the values are not those of the role
ONE_LETTER = 0.45  # lost by a name of one letter: "n" may be the engine speed, or a number
AGREES = 0.985
DISAGREES = 0.7
OF_THE_BENCH = ("authority", "authority_request", "throttle_authority", "rider_button")
ROLES_OF_TABLES = tuple(
    role for role in NEEDED if role not in (*REQUESTS, *OWN_STATUS, *OF_THE_BENCH, "throttle_fault")
)


@dataclass(frozen=True)
class Candidate:
    """A column in a role. score: 0..1, no probability. reasons: for people."""

    role: str
    column: Column
    score: float
    verdict: UnitVerdict
    reasons: tuple[str, ...]

    @property
    def is_resolved(self) -> bool:
        """Whether the role can be bound as it is: its unit is known, and suits the values."""
        return bool(self.verdict.unit) and self.verdict.plausible


@dataclass(frozen=True)
class RoleProposal:
    """Roles by name, in the order of NEEDED.

    bound       role -> its column
    unresolved  role -> a column whose unit is not known, or whose values do not suit the role
    others      role -> the next best columns
    free        columns without a role
    """

    columns: Columns
    bound: dict[str, Candidate]
    unresolved: dict[str, Candidate]
    others: dict[str, tuple[Candidate, ...]]
    free: tuple[Column, ...]

    def is_close(self, role: str) -> bool:
        """Whether another column is nearly as good for a bound role."""
        others = self.others.get(role, ())
        return bool(others) and self.bound[role].score - others[0].score < CLOSE


def propose_roles(columns: Columns) -> RoleProposal:
    """Roles for the columns of a table; no column has two roles."""
    base = columns.base()
    reference = _reference(columns, base)
    found = [
        candidate
        for role in ROLES_OF_TABLES
        for column in columns.numbers
        if (candidate := _candidate(role, column, base, reference)) is not None
    ]
    chosen = _assigned(found)
    taken = {candidate.column.name for candidate in chosen.values()}
    others = {
        role: tuple(
            each
            for each in sorted(found, key=lambda each: -each.score)
            if each.role == role and each.column.name not in taken and each.score >= ALIKE
        )[:3]
        for role in ROLES_OF_TABLES
    }
    free = tuple(column for column in columns.numbers if column.name not in taken)
    ordered = [(role, chosen[role]) for role in ROLES_OF_TABLES if role in chosen]
    bound = {role: each for role, each in ordered if each.is_resolved}
    unresolved = {role: each for role, each in ordered if not each.is_resolved}
    return RoleProposal(columns, bound, unresolved, others, free)


def _assigned(found: list[Candidate]) -> dict[str, Candidate]:
    """One column for each role, no column for two: the highest scores first."""
    order = {role: place for place, role in enumerate(ROLES_OF_TABLES)}
    chosen: dict[str, Candidate] = {}
    used: set[str] = set()
    for each in sorted(found, key=lambda each: (-each.score, order[each.role])):
        if each.score >= LEAST and each.role not in chosen and each.column.name not in used:
            chosen[each.role] = each
            used.add(each.column.name)
    return chosen


@dataclass(frozen=True)
class _Reference:
    """Speed with a stated unit. speed: m/s, on the common time base."""

    name: str
    speed: FloatArray


def _reference(columns: Columns, base: FloatArray) -> _Reference | None:
    """The fastest moving column that is called a speed, in a stated unit; None where there is none."""
    found = [
        _Reference(column.name, values * linear(column.unit, "m/s")[0])
        for column in columns.numbers
        if column.unit and converts(column.unit, "m/s") and _best_speed(column) >= LEAST
        for values in on_base(column, base)
    ]
    return max(found, key=lambda each: float(np.ptp(each.speed)), default=None)


def _best_speed(column: Column) -> float:
    return max(_by_name(column, role)[0] for role in SPEED_ROLES)


def _candidate(
    role: str, column: Column, base: FloatArray, reference: _Reference | None
) -> Candidate | None:
    score, named = _by_name(column, role)
    if score < ALIKE:
        return None
    own = next(on_base(column, base), None) if reference else None
    beside = None
    if reference is not None and own is not None and column.name != reference.name:
        beside = (reference.name, reference.speed, own)
    verdict = unit_verdict(role, column, beside)
    if not verdict.plausible:
        score -= IMPLAUSIBLE
    reasons = [*named, verdict.reason]
    if beside is not None and verdict.unit:
        for change, reason in _behaviour(role, verdict.unit, *beside):
            score += change
            reasons.append(reason)
    return Candidate(role, column, round(min(1.0, max(0.0, score)), 3), verdict, tuple(reasons))


def _by_name(column: Column, role: str) -> tuple[float, tuple[str, ...]]:
    """Score of a column by its name, its message and its unit, as `bind` has it, and the reasons."""
    message, _, name = column.name.rpartition(".")
    name = without_unit(name) or name
    bits = 1 if column.is_switch else 16
    unit = column.unit if converts(column.unit, column.unit) else ""
    signal = Signal(name, 0, bits, unit=unit)
    around = f"{message} {column.around}".strip()
    found = match(Message(around, 0, 8, (signal,)), signal, role)
    lost = ONE_LETTER if len(name) == 1 else 0.0
    reasons = tuple(reason for reason in found.reasons if reason.startswith("name"))
    return max(0.0, found.score - lost), reasons


def _behaviour(
    role: str, unit: str, name: str, speed: FloatArray, own: FloatArray
) -> Iterator[tuple[float, str]]:
    """Evidence from a comparison of the values with a speed: change of the score, and reason."""
    slope, zero = linear(unit, ROLES[role].unit)
    values = slope * own + zero
    if role in SPEED_ROLES:
        agreed = correlation(values, speed)
        if agreed >= AGREES:
            yield 0.1, f"follows {name} (correlation {agreed:.3f})"
        elif agreed < DISAGREES:
            yield -0.15, f"does not follow {name} (correlation {agreed:.2f})"
    elif role == "engine_speed":
        share, ratios = stepped(values, speed)
        if share >= 0.75 and len(ratios) > 1:
            yield 0.1, f"over {name} it steps between {len(ratios)} gear ratios ({share:.0%})"

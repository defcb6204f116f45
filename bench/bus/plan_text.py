"""Fault plan as JSON text, for files and for other processes."""

import json
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from slipbench.bench.bus.faults import (
    Corrupted,
    Delayed,
    Disturbed,
    Duplicated,
    Fault,
    FaultPlan,
    Frozen,
    Lost,
    Reordered,
    Where,
)
from slipbench.protocol.errors import InputError

KINDS: dict[str, type[Fault]] = {
    kind.__name__.lower(): kind
    for kind in (Disturbed, Lost, Corrupted, Duplicated, Delayed, Reordered, Frozen)
}
SETS = ("identifiers", "senders", "receivers")


def plan_text(plan: FaultPlan) -> str:
    """JSON text of a fault plan; `read_plan` reads it back unchanged."""
    faults = [{"fault": type(fault).__name__.lower(), **_plain(fault)} for fault in plan.faults]
    return json.dumps({"seed": plan.seed, "faults": faults})


def load_plan(path: Path) -> FaultPlan:
    """Fault plan of a JSON file. Raises InputError where it cannot be read or is not valid."""
    try:
        return read_plan(path.read_text(encoding="utf-8"))
    except InputError as fault:
        raise InputError(
            fault.what, where=str(path), expected=fault.expected, found=fault.found
        ) from fault
    except (OSError, UnicodeDecodeError) as cause:
        raise InputError(
            "the fault plan cannot be read", where=str(path), found=str(cause)
        ) from cause


def read_plan(text: str) -> FaultPlan:
    """Fault plan of a JSON text. Raises InputError where it is not valid."""
    try:
        document = json.loads(text)
        return FaultPlan(tuple(_fault(each) for each in document["faults"]), int(document["seed"]))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as cause:
        raise InputError(
            "not a fault plan",
            expected=f'{{"seed": 0, "faults": [{{"fault": one of {", ".join(KINDS)}, ...}}]}}',
            found=f"{type(cause).__name__}: {cause}",
        ) from cause


def _plain(fault: Fault) -> dict[str, Any]:
    plain = asdict(fault)
    if plain["where"]["end"] == float("inf"):
        del plain["where"]["end"]  # JSON has no infinity
    plain["where"].update({name: sorted(plain["where"][name]) for name in SETS})
    return plain


def _fault(entry: dict[str, Any]) -> Fault:
    values = dict(entry)
    kind = KINDS[values.pop("fault")]
    where: dict[str, Any] = {
        name: frozenset(value) if name in SETS else float(value)
        for name, value in values.pop("where", {}).items()
    }
    known = {field.name for field in fields(kind)} - {"where"}
    if values.keys() - known:
        raise KeyError(f"{kind.__name__.lower()} has no {sorted(values.keys() - known)}")
    numbers: dict[str, Any] = {name: float(value) for name, value in values.items()}
    return kind(**numbers, where=Where(**where))

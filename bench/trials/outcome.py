"""Outcome of a trial, and its tables in run.toml."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from slipbench.bench.gateway.gateway import PhaseChange
from slipbench.bench.loop.loop import Lateness
from slipbench.bench.safety.trial import TrialState
from slipbench.protocol.codec.messages import Phase, TripReason
from slipbench.protocol.extras import optional_library
from slipbench.protocol.notebook import card, table
from slipbench.protocol.trial_file import Timing, TrialFile


@dataclass(frozen=True)
class Outcome:
    """A trial's last state, its phases, and the lateness of every tick.

    died  why the loop could not report; state and phases are then the last reported ones
    """

    state: TrialState
    changes: tuple[PhaseChange, ...]
    lateness: Lateness
    notes: tuple[str, ...] = ()
    died: str = ""

    @property
    def done(self) -> bool:
        """Whether the trial ran to its end."""
        return self.state.phase == Phase.DONE

    @property
    def excited(self) -> bool:
        """Whether the trial was excited: otherwise there is nothing to identify."""
        return any(change.phase == Phase.EXCITING for change in self.changes)

    @property
    def trip(self) -> str:
        """Reason of the trip in words; empty if there was none."""
        return self.state.trip.detail if self.state.trip else self.died

    def to_pandas(self) -> Any:
        """A pandas.DataFrame of every tick that ran: lateness in s, and whether the bus refused it.

        Index: number of the tick. Raises InputError where pandas is not installed.
        """
        pandas = optional_library("pandas")
        late = self.lateness
        return pandas.DataFrame(
            {"lateness": late.lateness * 1e-9, "refused": late.refused},
            index=pandas.Index(late.tick, name="tick"),
        )

    def _repr_html_(self) -> str:
        last = self.state.phase.name.lower()
        lines = [f"Last phase: {last}.", *([f"Trip: {self.trip}"] if self.trip else [])]
        begun = self.changes[0].time_ns if self.changes else 0
        rows = [(c.phase.name.lower(), (c.time_ns - begun) * 1e-9) for c in self.changes]
        return card("Trial", [*lines, *in_short(self.notes)], table(("phase", "since, s"), rows))


def outcome_tables(outcome: Outcome, trial: TrialFile) -> dict[str, Any]:
    """Tables of run.toml for an outcome."""
    reason = outcome.state.trip.reason if outcome.state.trip else TripReason.NONE
    lateness = outcome.lateness
    why_not = invalid(outcome, trial.timing)
    return {
        "outcome": {
            "valid": not why_not,
            **({"invalid": why_not} if why_not else {}),
            "phase": outcome.state.phase.name.lower(),
            "trip": reason.name.lower(),
            "detail": outcome.trip,
            **_operating_point(outcome.state),
            "notes": list(outcome.notes),
            "phases": [
                {"phase": change.phase.name.lower(), "time_ns": change.time_ns}
                for change in outcome.changes
            ],
        },
        "lateness": {
            "period": lateness.period * 1e-9,
            "due": lateness.due,
            "ran": int(lateness.tick.size),
            "skipped": lateness.skipped,
            "refused": int(np.sum(lateness.refused)),
            **lateness.quantiles(),
        },
    }


def in_short(notes: Sequence[str], most: int = 8) -> list[str]:
    """Notes for a terminal: each once with its count, then the number of notes that are not shown."""
    counts = Counter(notes)
    lines = [f"{note} ({n} times)" if n > 1 else note for note, n in counts.items()]
    if len(lines) <= most:
        return lines
    return [*lines[:most], f"and {len(lines) - most} others, in run.toml"]


def invalid(outcome: Outcome, timing: Timing) -> str:
    """Reason why the trial's timing is invalid; empty where it is valid.

    Only the ticks with authority count: those before them moved nothing.
    """
    if outcome.died:
        return outcome.died
    lateness = outcome.lateness
    began = [change.time_ns for change in outcome.changes if change.phase == Phase.EXCITING]
    if not began or not lateness.due:
        return ""
    first = (began[0] - lateness.start) // lateness.period
    last = max(change.time_ns for change in outcome.changes)
    due = max((last - began[0]) // lateness.period, 1)
    held = (lateness.tick >= first) & (lateness.tick < first + due)
    refused = int(np.sum(lateness.refused[held]))
    late = int(np.sum((lateness.lateness > timing.late * 1e9)[held & ~lateness.refused]))
    skipped = int(due - np.sum(held))
    if late + skipped + refused <= timing.budget * due:
        return ""
    return (
        f"{late} ticks of {due} with authority were more than {timing.late * 1e3:g} ms late, "
        f"{skipped} skipped and {refused} refused by the bus: "
        f"over the budget of {timing.budget:.2%} (timing.budget)"
    )


def _operating_point(state: TrialState) -> dict[str, float]:
    """Opening at the operating point, where the trial reached it."""
    return {} if math.isnan(state.throttle) else {"operating_throttle": state.throttle}

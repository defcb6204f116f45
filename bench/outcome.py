"""How a trial ended, and what of it goes into run.toml."""

import math
from dataclasses import dataclass
from typing import Any

from bench.gateway import PhaseChange
from bench.loop import Lateness
from bench.trial import TrialState
from protocol.messages import Phase, TripReason


@dataclass(frozen=True)
class Outcome:
    """A trial's last state, its phases, and what became of every tick."""

    state: TrialState
    changes: tuple[PhaseChange, ...]
    lateness: Lateness
    notes: tuple[str, ...] = ()

    @property
    def done(self) -> bool:
        """Tell whether the trial ran to its end."""
        return self.state.phase == Phase.DONE

    @property
    def excited(self) -> bool:
        """Tell whether there is anything to identify."""
        return any(change.phase == Phase.EXCITING for change in self.changes)

    @property
    def trip(self) -> str:
        """Say why it tripped; empty where it did not."""
        return self.state.trip.detail if self.state.trip else ""


def told(outcome: Outcome) -> dict[str, Any]:
    """Lay an outcome out as tables of run.toml."""
    reason = outcome.state.trip.reason if outcome.state.trip else TripReason.NONE
    lateness = outcome.lateness
    return {
        "outcome": {
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
            **lateness.quantiles(),
        },
    }


def ticks_table(lateness: Lateness, late: int = 100_000) -> str:
    """List every tick that ran more than `late` ns after it was due, or not at all, as CSV."""
    lines = ["tick,due_ns,lateness_ns,fate"]
    expected = 0
    for number, lag in zip(lateness.tick.tolist(), lateness.lateness.tolist(), strict=True):
        lines.extend(
            f"{missing},{lateness.start + missing * lateness.period},,skipped"
            for missing in range(expected, number)
        )
        if lag > late or number > expected:
            lines.append(f"{number},{lateness.start + number * lateness.period},{lag},late")
        expected = number + 1
    return "\n".join(lines) + "\n"


def _operating_point(state: TrialState) -> dict[str, float]:
    """Tell the opening about which was excited, where the trial came to that."""
    return {} if math.isnan(state.throttle) else {"operating_throttle": state.throttle}

"""Runs of a session that `explain` compares with the simulation: few, each with a reason.

An analysis takes time in proportion to its runs, and further repeats of the same trial excite nothing
else. So each trial trains with its best runs in turn, and the last repeat of a trial is held out.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest

from slipbench.identification.session.day import Run

TRAINING = 2
"""Training runs at most, unless there are more trials: then one of each."""
HELD_OUT = 2
"""Held-out runs at most: of trials of different actuators first."""


@dataclass(frozen=True)
class Chosen:
    """A run of an analysis and why it was chosen."""

    run: Run
    reason: str


@dataclass(frozen=True)
class Selection:
    """Runs of an analysis. others: usable runs that take no part in it."""

    training: tuple[Chosen, ...]
    held_out: tuple[Chosen, ...]
    others: tuple[Run, ...] = ()

    @property
    def lines(self) -> tuple[str, ...]:
        """The selection in sentences."""
        found = [f"{one.run.name}: training: {one.reason}" for one in self.training]
        found += [f"{one.run.name}: held out: {one.reason}" for one in self.held_out]
        if self.others:
            names = ", ".join(run.name for run in self.others)
            found.append(f"not used: further repeats of these trials: {names}")
        return tuple(found)


def selection(runs: Sequence[Run]) -> Selection:
    """Selection among the usable runs of a session, in their order.

    Every trial trains with at least one run; the held-out ones are the last repeats of trials that
    have several.
    """
    trials = [list(rows) for rows in _by_trial(runs)]
    held = _held_out([rows for rows in trials if len(rows) > 1])
    ranked = [sorted((r for r in rows if r not in held), key=_worse) for rows in trials]
    turns = [run for turn in zip_longest(*ranked) for run in turn if run is not None]
    training = turns[: max(TRAINING, len(trials))]
    return Selection(
        tuple(Chosen(run, _excites(run)) for run in training),
        tuple(Chosen(run, f"last repeat of {run.trial}") for run in held),
        tuple(run for run in runs if run.usable and run not in training and run not in held),
    )


def _by_trial(runs: Sequence[Run]) -> Iterator[list[Run]]:
    for trial in dict.fromkeys(run.trial for run in runs if run.usable):
        yield [run for run in runs if run.usable and run.trial == trial]


def _held_out(trials: Sequence[Sequence[Run]]) -> list[Run]:
    """Last repeats, those of an actuator that has none yet before others."""
    last = [rows[-1] for rows in trials]
    actuators = [run.look.get("actuator") for run in last]
    repeated = [actuators[:i].count(actuator) for i, actuator in enumerate(actuators)]
    return [run for _, run in sorted(zip(repeated, last, strict=True), key=lambda p: p[0])][
        :HELD_OUT
    ]


def _worse(run: Run) -> tuple[float, float]:
    """Order of the runs of a trial: most of the planned band first, then the highest coherence."""
    return -float(run.look.get("covered") or 0.0), -float(run.look.get("coherence") or 0.0)


def _excites(run: Run) -> str:
    band = run.look.get("reliable_band")
    reliable = f", {band[0]:.1f} to {band[1]:.1f} Hz reliable" if band else ""
    return f"excites the {run.look.get('actuator', 'motorcycle')}{reliable}"

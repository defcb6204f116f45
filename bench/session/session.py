"""A session: ride what is planned, look at it, and go on where it was interrupted.

Each step follows from the folder alone (`next_step`), so an interruption at any time costs at most
the run that was being recorded; and that is kept.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path
from typing import Any

import tomli_w

from slipbench.bench.session.designed_runs import designed_runs
from slipbench.bench.session.plan_file import SessionPlan, read_plan
from slipbench.bench.session.planned_runs import PlannedRun, planned_runs
from slipbench.bench.session.rider_line import PHASES, WAITING, ArmingWatch, instruction
from slipbench.bench.session.session_folder import (
    Attempt,
    attempt_path,
    attempts,
    complete,
    make_durable,
    set_aside,
    why_incomplete,
    write_look,
    write_whole,
)
from slipbench.bench.trials.connection import Connection, Ends, connected
from slipbench.bench.trials.outcome import Outcome, in_short
from slipbench.bench.trials.preparation import Prepared, prepare
from slipbench.bench.trials.run import run_trial
from slipbench.bench.trials.simulated_trial import simulated_names
from slipbench.protocol.codec.messages import Phase, TripReason
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.run_folder import TRIAL, VEHICLE

REPEAT = "repeat"  # verdict that asks for another attempt
OTHER = "other amplitude"  # verdict after which a trial is not run again as it is
AGAIN = frozenset({TripReason.NEVER_READY, TripReason.NEVER_PRESSED})
AGAIN_AFTER = 20  # tenths of a second
Say = Callable[[str], None]
Look = Callable[[Path, Sequence[Path]], dict[str, Any]]
"""Quick look at a run folder, given those of earlier repeats: verdict, reason, lines, and more."""


@dataclass(frozen=True)
class Session:
    """A plan, its runs in order, and the folder in which they are recorded.

    database, binding  as a trial has them
    """

    plan: SessionPlan
    runs: tuple[PlannedRun, ...]
    folder: Path
    database: Path | None = None
    binding: Path | None = None

    def trial_path(self, run: PlannedRun) -> Path:
        """Path of the trial file of a run."""
        return self.folder / "trials" / f"{run.name}.toml"

    def attempts(self, run: PlannedRun) -> list[Attempt]:
        """Complete attempts at a run."""
        return attempts(self.folder, run.name)

    def finished(self, run: PlannedRun) -> bool:
        """Whether a run needs no other attempt."""
        done = self.attempts(run)
        if not done:
            return self.given_up(run)
        return done[-1].verdict != REPEAT or len(done) >= self.plan.attempts

    def given_up(self, run: PlannedRun) -> bool:
        """Whether a run is left out, because an earlier one of its trial asks for another amplitude."""
        return any(
            attempt.verdict == OTHER
            for other in self.runs
            if other.trial == run.trial
            for attempt in self.attempts(other)
        )


@dataclass(frozen=True)
class Ride:
    """The next step is to record this run, as attempt `number`."""

    run: PlannedRun
    number: int


@dataclass(frozen=True)
class TakeLook:
    """The next step is the quick look at an attempt; earlier: run folders of the same trial."""

    run: PlannedRun
    attempt: Attempt
    earlier: tuple[Path, ...] = field(default=())


def open_session(
    path: Path, folder: Path, database: Path | None = None, binding: Path | None = None
) -> Session:
    """Session of a plan in its folder, which must be locked; every trial is checked.

    Designed trials that were accepted follow the runs of the plan. Raises InputError where plan, a trial or a vehicle is invalid, or where a trial was changed of
    which runs are recorded already.
    """
    plan = read_plan(path)
    planned = planned_runs(plan, path, folder / "trials")
    runs = (*planned, *designed_runs(folder, planned))
    session = Session(plan, runs, folder, database, binding)
    for run in runs:
        _refuse_change(session, run, path)
    write_whole(folder / "plan.toml", path.read_text(encoding="utf-8"))
    for run in runs:
        write_whole(session.trial_path(run), tomli_w.dumps(dict(run.file)))
        _prepared(session, run)
    return session


def _refuse_change(session: Session, run: PlannedRun, path: Path) -> None:
    """Check that a run that is recorded had this trial and this vehicle. Raises InputError."""
    done = session.attempts(run)
    if not done:
        return
    vehicle = (session.folder / "trials" / run.file["vehicle"]).resolve()
    same = _without_paths(load_toml(done[0].path / TRIAL)) == _without_paths(run.file)
    if same and load_toml(done[0].path / VEHICLE) == load_toml(vehicle):
        return
    raise InputError(
        f"{'the vehicle of ' if same else ''}trial {run.trial!r} differs from the recorded one",
        where=str(path),
        found=str(done[0].path),
        remedy="give the changed trial another name, so that its runs are not mixed with these",
    )


def _without_paths(tree: Mapping[str, Any]) -> dict[str, Any]:
    """A trial file without the paths in it: a session that was moved to another folder goes on."""
    kept = {key: value for key, value in tree.items() if key not in ("vehicle", "controller")}
    controller = tree.get("controller")
    return kept | ({"target": controller.get("target")} if controller else {})


def _prepared(session: Session, run: PlannedRun) -> Prepared:
    prepared = prepare(session.trial_path(run), session.database, session.binding)
    return replace(prepared, tags=session.plan.tags)


def next_step(session: Session) -> Ride | TakeLook | None:
    """Next step of the session; None where the plan is complete. It reads the folder only."""
    for run in session.runs:
        done = session.attempts(run)
        unseen = next((each for each in done if not each.verdict), None)
        if unseen is not None:
            return TakeLook(run, unseen, _earlier(session, run, unseen))
        if not session.finished(run):
            return Ride(run, done[-1].number + 1 if done else 1)
    return None


def _earlier(session: Session, run: PlannedRun, attempt: Attempt) -> tuple[Path, ...]:
    """Run folders of the same trial that came before an attempt and count."""
    return tuple(
        each.path
        for other in session.runs
        if other.trial == run.trial and other.repeat < run.repeat
        for each in session.attempts(other)
        if each.counts and each.path != attempt.path
    )


def usable_runs(session: Session) -> dict[str, tuple[Path, ...]]:
    """Run folders by trial that count."""
    return {
        planned.name: tuple(
            each.path
            for run in session.runs
            if run.trial == planned.name
            for each in session.attempts(run)
            if each.counts
        )
        for planned in session.plan.trial
    }


def run_session(session: Session, connection: Connection, look: Look, say: Say) -> bool:
    """Do all that is planned and not done yet; whether each run has a usable recording.

    say: receives lines for people. Raises InputError where a trial cannot begin or its recording
    is incomplete, and KeyboardInterrupt where the operator ends it; the same call goes on from there.
    """
    try:
        _do_all(session, connection, look, say)
    except KeyboardInterrupt:
        if (step := next_step(session)) is not None:
            say(f"stopped; the same command goes on with {step.run.name}")
        raise
    left_out = [run.name for run in session.runs if not session.attempts(run)]
    if left_out:
        say(f"left out until the plan has another amplitude: {', '.join(left_out)}")
    return all(any(each.counts for each in session.attempts(run)) for run in session.runs)


def _do_all(session: Session, connection: Connection, look: Look, say: Say) -> None:
    _set_aside_interrupted(session, say)
    while (step := next_step(session)) is not None:
        if isinstance(step, TakeLook):
            _take_look(step, look, say)
        else:
            _ride(session, step, connection, say)


def _set_aside_interrupted(session: Session, say: Say) -> None:
    for run in session.runs:
        for number in count(1):
            path = attempt_path(session.folder, run.name, number)
            if not path.exists():
                break
            if not complete(path):
                why = why_incomplete(path)
                say(f"{path.name} is incomplete ({why}): kept as {set_aside(path).name}")


def _take_look(step: TakeLook, look: Look, say: Say) -> None:
    found = look(step.attempt.path, step.earlier)
    write_look(step.attempt.path, found)
    for line in found["lines"]:
        say(f"  {line}")
    say(f"{step.attempt.path.name}: {found['verdict']}: {found['reason']}")


def _ride(session: Session, step: Ride, connection: Connection, say: Say) -> None:
    """Record a run. Raises InputError where it came to no end that counts."""
    prepared = _prepared(session, step.run)
    path = attempt_path(session.folder, step.run.name, step.number)
    extra = f", attempt {step.number}" if step.number > 1 else ""
    say(
        f"{step.run.trial} {step.run.repeat} of {step.run.of}{extra}: {instruction(prepared.trial)}"
    )
    with connected(prepared, connection) as ends:
        outcome = _recorded(prepared, path, ends, say)
    make_durable(path)
    for note in in_short(outcome.notes):
        say(f"  note: {note}")
    if complete(path):
        return
    trip = outcome.state.trip
    if trip is not None and trip.reason in AGAIN and not connection.simulated:
        say(f"  not begun: {outcome.trip}; kept as {set_aside(path).name}")
        return
    if trip is not None and trip.reason == TripReason.STOPPED:
        raise KeyboardInterrupt
    raise InputError(
        "the session stops, because a run came to no end",
        where=str(path),
        found=why_incomplete(path),
        remedy="fix the cause, then give the same command: it goes on with this run",
    )


def _recorded(prepared: Prepared, path: Path, ends: Ends, say: Say) -> Outcome:
    """Outcome of a trial while lines say which phase it is in, or why it is not armed."""
    addresses, vehicle = ends
    names = simulated_names(prepared.binding)
    if addresses is not None:
        names = [address.name for address in addresses]
    watch = ArmingWatch(prepared, path, tuple(names))
    lines = _RiderLines(watch, prepared.trial.operating_point.steady_for, say)
    return run_trial(prepared, path, addresses, lines.progress, lines.on_phase, vehicle)


class _RiderLines:
    """Lines for the rider while a trial runs: each phase, and what is missing to arm."""

    def __init__(self, watch: ArmingWatch, steady_for: float, say: Say) -> None:
        self._watch, self._say = watch, say
        self._steady = f"keep gear and engine speed for {steady_for}"
        self._phase, self._unchanged = Phase.IDLE, 0
        self._shown: str | None = None

    def on_phase(self, phase: Phase) -> None:
        """Say what the rider does in a phase that begins."""
        self._phase = phase
        if phase in PHASES:
            self._say(f"  {PHASES[phase]}")

    def progress(self, _seconds: float) -> None:
        """Say why the bench is not armed: when the reason changes, and its figures now and then."""
        if self._phase not in WAITING:
            return
        reason = self._watch.reason()  # while armed too: the watch must not fall behind
        if self._phase != Phase.IDLE:
            return
        words, self._unchanged = re.sub(r"\d+", "#", reason), self._unchanged + 1
        if words == self._shown and self._unchanged < AGAIN_AFTER:
            return
        self._shown, self._unchanged = words, 0
        self._say(f"  not armed: {reason or self._steady}")

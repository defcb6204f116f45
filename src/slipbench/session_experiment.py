"""Designed trials of a session: offered after the planned runs, accepted, ridden, and explained again.

Each step follows from the folder alone, so the same command goes on after an interruption:

    designed/hypotheses.json   questions that the analysis of the planned runs left open
    designed/improved.toml     improved vehicle of that analysis
    designed/offer-N.toml      the trial, and in offer-N.json the answer; its run is designed_N-1
    designed/evidence.json     of each designed run: predictive densities under the hypotheses

It ends when no question is open (e-values, `identification/experiments/sequential_test.py`), when an
offer is declined, when no trial inside the limits separates what is open, or after so many offers.
"""

import json
import os
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from slipbench.protocol.errors import InputError
from slipbench.session_explain import MEMO, explained

if TYPE_CHECKING:  # the analyses take seconds to import; --help should not
    from slipbench.bench.session.designed_runs import Offer
    from slipbench.bench.session.session import Session
    from slipbench.identification.experiments.settling import Asked

MOST = 3
"""Offers of a session: what three trials leave open needs other sensors or another straight."""
EVIDENCE, IMPROVED = "evidence.json", "improved.toml"
FIRST_SEED = 7001  # of a designed trial: noise of its own on the virtual motorcycle
Say = Callable[[str], None]
Ride = Callable[[], "Session"]
"""Opens the session anew, records what is accepted and not recorded yet, and returns the session."""


@dataclass(frozen=True)
class Experiment:
    """What an engineer allows.

    straight: m; vehicle: of the nominal simulation; accept: each offer; offers: how many at most
    """

    straight: float
    vehicle: Path
    accept: bool
    offers: int = MOST


def run_experiment(session: "Session", allowed: Experiment, ride: Ride, say: Say) -> None:
    """Offer, ride and explain designed trials until the questions of the session are settled.

    The evidence of a run comes first, since it takes seconds and decides whether to go on.

    Raises InputError where a trial cannot begin, KeyboardInterrupt where the operator ends it.
    """
    while True:
        asked = _asked(session, allowed.vehicle, say)
        if asked is None or _ended(session, asked, allowed.offers, say):
            return
        explained(
            session, allowed.vehicle, say
        )  # with the designed runs: the next one starts there
        offer = _offer(session, asked, allowed, say)
        if offer is None or not _accepted(offer, allowed, say):
            return
        session = ride()


def _asked(session: "Session", vehicle: Path, say: Say) -> "Asked | None":
    """The questions with the evidence of every designed run; None where there are none."""
    from slipbench.bench.session.designed_runs import FOLDER
    from slipbench.identification.mismatch.telling.open_questions import NAME

    folder = session.folder / FOLDER
    if not (folder / NAME).exists():
        verdict, why_not = explained(session, vehicle, say)
        if verdict is None or not _begun(session, folder):
            say(f"no trial is designed: {why_not or 'the analysis left nothing open'}")
            return None
    asked = _with_evidence(session, folder, say)
    for line in _lines(asked):
        say(f"  {line}")
    return asked


def _begun(session: "Session", folder: Path) -> bool:
    """Write the questions of the analysis for the rest of the session; whether there are any."""
    from slipbench.bench.session.session_folder import write_whole
    from slipbench.identification.experiments.settling import first_questions
    from slipbench.identification.mismatch.telling.open_questions import NAME, read_open_questions

    memo = session.folder / MEMO
    if not (memo / NAME).exists():
        return False
    opened = read_open_questions(memo / NAME)
    if not opened.questions:
        return False
    folder.mkdir(exist_ok=True)
    shutil.copyfile(memo / opened.improved, folder / IMPROVED)
    first = first_questions(opened, memo, folder).model_copy(update={"improved": IMPROVED})
    write_whole(folder / NAME, json.dumps(first.model_dump(), indent=1) + "\n")
    return True


def _with_evidence(session: "Session", folder: Path, say: Say) -> "Asked":
    """The questions; the evidence of runs that have none yet is computed and kept."""
    from slipbench.bench.session.session_folder import write_whole
    from slipbench.identification.experiments.settling import (
        Asked,
        evidence_from,
        evidence_of,
        evidence_tree,
    )
    from slipbench.identification.mismatch.telling.open_questions import NAME, read_open_questions

    path = folder / EVIDENCE
    known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    asked = Asked(read_open_questions(folder / NAME), folder, evidence_from(known))
    runs = _designed(session)
    for number in range(len(asked.evidence), len(runs)):
        say(f"predicting {runs[number].name} under each hypothesis")
        new = evidence_of(asked, runs[:number], runs[number])
        asked = Asked(asked.opened, folder, (*asked.evidence, new))
        write_whole(path, json.dumps(evidence_tree(asked.evidence), indent=1) + "\n")
    return asked


def _designed(session: "Session") -> list[Path]:
    """Usable runs of designed trials, in their order."""
    from slipbench.bench.session.designed_runs import offers

    names = {offer.trial for offer in offers(session.folder)}
    return [
        attempt.path
        for run in session.runs
        if run.trial in names
        for attempt in session.attempts(run)
        if attempt.counts
    ]


def _lines(asked: "Asked") -> tuple[str, ...]:
    from slipbench.identification.experiments.settling import lines_of

    return lines_of(asked)


def _ended(session: "Session", asked: "Asked", most: int, say: Say) -> bool:
    """Whether nothing more is offered, and why."""
    from slipbench.bench.session.designed_runs import offers

    made = offers(session.folder)
    if asked.settled:
        say(f"settled after {len(asked.evidence)} designed runs")
        return True
    if len(asked.evidence) < sum(offer.answer == "accepted" for offer in made):
        say("the designed run is not usable: no other trial is offered")
        return True
    if len(made) >= most and made[-1].answer:
        say(f"open after {len(made)} offers: no other trial is offered")
        return True
    return False


def _offer(session: "Session", asked: "Asked", allowed: Experiment, say: Say) -> "Offer | None":
    """The offer that waits for an answer, else a new one; None where there is none."""
    from slipbench.bench.session.designed_runs import offers, write_offer

    made = offers(session.folder)
    if made and not made[-1].answer:
        return made[-1]
    if made and made[-1].answer == "declined":
        say("the last offer was declined: no other trial is offered")
        return None
    say("designing the trial that settles what is open")
    try:
        tree, text = _designed_trial(session, asked, allowed.straight, say)
    except InputError as fault:
        say(f"no trial is offered: {fault}")
        return None
    number = len(made) + 1
    return write_offer(session.folder, number, {**tree, "seed": FIRST_SEED + number}, text)


def _designed_trial(
    session: "Session", asked: "Asked", straight: float, say: Say
) -> tuple[dict[str, object], str]:
    """The trial for what is open, for the vehicle as the last analysis improved it."""
    from slipbench.identification.mismatch.telling.open_questions import NAME, read_open_questions
    from slipbench.next_command import designed_from

    memo = session.folder / MEMO
    improved = memo / read_open_questions(memo / NAME).improved
    opened = asked.still_open.model_copy(
        update={"improved": os.path.relpath(improved, asked.folder)}
    )
    place = session.folder / "trials"
    return designed_from(asked.folder, opened, straight, [], [], place, say)


def _accepted(offer: "Offer", allowed: Experiment, say: Say) -> bool:
    """Whether the offer is accepted; the answer is kept."""
    from slipbench.bench.session.designed_runs import answered

    say(f"offer {offer.number}: {offer.text}")
    say(f"  limits and excitation: {offer.path}")
    if not allowed.accept and not sys.stdin.isatty():
        say("  not answered: give the same command at a terminal, or with --accept")
        return False
    yes = allowed.accept or _confirmed()
    answered(offer, "accepted" if yes else "declined")
    say("  accepted" if yes else "  declined")
    return yes


def _confirmed() -> bool:
    """The answer at the terminal. Ctrl-C ends the session and leaves the offer without an answer."""
    try:
        return typer.confirm("accept it? The rider arms it as every other run", default=False)
    except typer.Abort as end:
        raise KeyboardInterrupt from end


def lines_for_report(session: "Session") -> tuple[str, ...]:
    """Offers with their answers, and what the evidence says; nothing where there was no offer."""
    from slipbench.bench.session.designed_runs import FOLDER, offers
    from slipbench.identification.experiments.settling import Asked, evidence_from
    from slipbench.identification.mismatch.telling.open_questions import NAME, read_open_questions

    made = offers(session.folder)
    folder = session.folder / FOLDER
    if not made or not (folder / NAME).exists():
        return ()
    said = [f"{one.trial}: {one.answer or 'not answered'}: {one.text}" for one in made]
    path = folder / EVIDENCE
    known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    if known:
        asked = Asked(read_open_questions(folder / NAME), folder, evidence_from(known))
        said += _lines(asked)
    return tuple(said)

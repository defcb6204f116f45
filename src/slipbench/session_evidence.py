"""Open questions of a session, and what its designed runs say about them.

designed/hypotheses.json   questions that the analysis of the planned runs left open
designed/improved.toml     improved vehicle of that analysis
designed/evidence.json     of each designed run: predictive densities under the hypotheses
"""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from slipbench.session_explain import MEMO

if TYPE_CHECKING:  # the analyses take seconds to import; --help should not
    from slipbench.bench.session.session import Session
    from slipbench.identification.experiments.settling import Asked

EVIDENCE, IMPROVED = "evidence.json", "improved.toml"
Say = Callable[[str], None]


def begun(session: "Session", folder: Path) -> bool:
    """Write the questions of the analysis for the rest of the session; whether there are any."""
    from slipbench.bench.session.session_folder import write_whole
    from slipbench.identification.experiments.settling import first_questions
    from slipbench.identification.mismatch.reporting.open_questions import NAME, read_open_questions

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


def with_evidence(session: "Session", folder: Path, say: Say) -> "Asked":
    """The questions; the evidence of runs that have none yet is computed and kept."""
    from slipbench.bench.session.session_folder import write_whole
    from slipbench.identification.experiments.settling import (
        Asked,
        evidence_from,
        evidence_of,
        evidence_tree,
    )
    from slipbench.identification.mismatch.reporting.open_questions import NAME, read_open_questions

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


def lines_of_evidence(asked: "Asked") -> tuple[str, ...]:
    """Evidence of the designed runs as lines, one for each question."""
    from slipbench.identification.experiments.settling import lines_of

    return lines_of(asked)


def lines_for_report(session: "Session") -> tuple[str, ...]:
    """Offers with their answers, and what the evidence says; nothing where there was no offer."""
    from slipbench.bench.session.designed_runs import FOLDER, offers
    from slipbench.identification.experiments.settling import Asked, evidence_from
    from slipbench.identification.mismatch.reporting.open_questions import NAME, read_open_questions

    made = offers(session.folder)
    folder = session.folder / FOLDER
    if not made or not (folder / NAME).exists():
        return ()
    said = [f"{one.trial}: {one.answer or 'not answered'}: {one.text}" for one in made]
    path = folder / EVIDENCE
    known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    if known:
        asked = Asked(read_open_questions(folder / NAME), folder, evidence_from(known))
        said += lines_of_evidence(asked)
    return tuple(said)

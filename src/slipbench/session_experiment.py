"""Designed trials of a session: offered after the planned runs, accepted, ridden, and explained again.

Each step follows from the folder `designed` alone, so the same command goes on after an interruption. Its files are
those of session_evidence.py and session_offer.py.

It ends when no question is open (e-values, `identification/experiments/sequential_test.py`), when an
offer is declined, when no trial inside the limits separates what is open, or after so many offers.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from slipbench.session_evidence import begun, lines_of_evidence, with_evidence
from slipbench.session_explain import explained
from slipbench.session_offer import accepted, next_offer

if TYPE_CHECKING:  # the analyses take seconds to import; --help should not
    from slipbench.bench.session.session import Session
    from slipbench.identification.experiments.settling import Asked

MOST = 3
"""Offers of a session: what three trials leave open needs other sensors or another straight."""
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
        explained(session, allowed.vehicle, say)  # with the designed runs: the next starts there
        offer = next_offer(session, asked, allowed.straight, say)
        if offer is None or not accepted(offer, allowed.accept, say):
            return
        session = ride()


def _asked(session: "Session", vehicle: Path, say: Say) -> "Asked | None":
    """The questions with the evidence of every designed run; None where there are none."""
    from slipbench.bench.session.designed_runs import FOLDER
    from slipbench.identification.mismatch.reporting.open_questions import NAME

    folder = session.folder / FOLDER
    if not (folder / NAME).exists():
        verdict, why_not = explained(session, vehicle, say)
        if verdict is None or not begun(session, folder):
            say(f"no trial is designed: {why_not or 'the analysis left nothing open'}")
            return None
    asked = with_evidence(session, folder, say)
    for line in lines_of_evidence(asked):
        say(f"  {line}")
    return asked


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

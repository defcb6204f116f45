"""Offer of a designed trial in a session: designed for what is open, and answered by the engineer.

designed/offer-N.toml      the trial, and in offer-N.json the answer; its run is designed_N-1
"""

import os
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

import typer

from slipbench.protocol.errors import InputError
from slipbench.session_explain import MEMO

if TYPE_CHECKING:  # the analyses take seconds to import; --help should not
    from slipbench.bench.session.designed_runs import Offer
    from slipbench.bench.session.session import Session
    from slipbench.identification.experiments.settling import Asked

FIRST_SEED = 7001  # of a designed trial: noise of its own on the virtual motorcycle
Say = Callable[[str], None]


def next_offer(session: "Session", asked: "Asked", straight: float, say: Say) -> "Offer | None":
    """The offer that waits for an answer, else a new one; None where there is none. straight: m."""
    from slipbench.bench.session.designed_runs import offers, write_offer

    made = offers(session.folder)
    if made and not made[-1].answer:
        return made[-1]
    if made and made[-1].answer == "declined":
        say("the last offer was declined: no other trial is offered")
        return None
    say("designing the trial that settles what is open")
    try:
        tree, text = designed_trial(session, asked, straight, say)
    except InputError as fault:
        say(f"no trial is offered: {fault}")
        return None
    number = len(made) + 1
    return write_offer(session.folder, number, {**tree, "seed": FIRST_SEED + number}, text)


def designed_trial(
    session: "Session", asked: "Asked", straight: float, say: Say
) -> tuple[dict[str, object], str]:
    """The trial for what is open, for the vehicle as the last analysis improved it. straight: m."""
    from slipbench.identification.mismatch.reporting.open_questions import NAME, read_open_questions
    from slipbench.next_command import designed_from

    memo = session.folder / MEMO
    improved = memo / read_open_questions(memo / NAME).improved
    opened = asked.still_open.model_copy(
        update={"improved": os.path.relpath(improved, asked.folder)}
    )
    place = session.folder / "trials"
    return designed_from(asked.folder, opened, straight, [], [], place, say)


def accepted(offer: "Offer", accept: bool, say: Say) -> bool:
    """Whether the offer is accepted; the answer is kept. accept: without a question."""
    from slipbench.bench.session.designed_runs import answered

    say(f"offer {offer.number}: {offer.text}")
    say(f"  limits and excitation: {offer.path}")
    if not accept and not sys.stdin.isatty():
        say("  not answered: give the same command at a terminal, or with --accept")
        return False
    yes = accept or _confirmed()
    answered(offer, "accepted" if yes else "declined")
    say("  accepted" if yes else "  declined")
    return yes


def _confirmed() -> bool:
    """The answer at the terminal. Ctrl-C ends the session and leaves the offer without an answer."""
    try:
        return typer.confirm("accept it? The rider arms it as every other run", default=False)
    except typer.Abort as end:
        raise KeyboardInterrupt from end

"""Trials that were designed during a session: offered, answered, and then run like planned ones.

    designed/offer-1.toml   trial file that is offered
    designed/offer-1.json   what it is to show, and the answer

An accepted offer is the run designed_1-1. It is armed by the rider like every other run.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any, Literal

import tomli_w

from slipbench.bench.session.planned_runs import PlannedRun
from slipbench.bench.session.session_folder import write_whole
from slipbench.protocol.configuration import load_toml, parse
from slipbench.protocol.errors import InputError
from slipbench.protocol.trial_file import TrialFile

FOLDER = "designed"
Answer = Literal["", "accepted", "declined"]


@dataclass(frozen=True)
class Offer:
    """A designed trial. number: from 1; text: what it is to show; answer: "" before there is one."""

    number: int
    text: str
    answer: Answer
    path: Path

    @property
    def trial(self) -> str:
        """Name of the trial."""
        return f"designed_{self.number}"


def offers(folder: Path) -> tuple[Offer, ...]:
    """Offers of a session, the first one first. Raises InputError where one cannot be read."""
    found = list[Offer]()
    for number in count(1):
        path = folder / FOLDER / f"offer-{number}.json"
        if not path.exists():
            return tuple(found)
        found.append(_read(path, number))
    raise AssertionError


def _read(path: Path, number: int) -> Offer:
    try:
        tree = json.loads(path.read_text(encoding="utf-8"))
        answer = tree["answer"]
        if answer not in ("", "accepted", "declined"):
            raise ValueError(f"answer {answer!r}")
        return Offer(number, str(tree["text"]), answer, path.with_suffix(".toml"))
    except (ValueError, KeyError, TypeError) as cause:
        raise InputError(
            "the offer cannot be read",
            where=str(path),
            found=str(cause),
            remedy="remove that file: the trial is designed anew",
        ) from cause


def write_offer(folder: Path, number: int, file: Mapping[str, Any], text: str) -> Offer:
    """Write a designed trial as an offer without an answer. file: its paths lead from trials."""
    path = folder / FOLDER / f"offer-{number}.toml"
    path.parent.mkdir(exist_ok=True)
    write_whole(path, tomli_w.dumps(dict(file)))
    return _write(Offer(number, text, "", path))


def answered(offer: Offer, answer: Answer) -> Offer:
    """Write the answer to an offer; it holds for every later call of the session."""
    return _write(Offer(offer.number, offer.text, answer, offer.path))


def _write(offer: Offer) -> Offer:
    tree = {"text": offer.text, "answer": offer.answer}
    write_whole(offer.path.with_suffix(".json"), json.dumps(tree, indent=1) + "\n")
    return offer


def designed_runs(folder: Path, planned: tuple[PlannedRun, ...]) -> tuple[PlannedRun, ...]:
    """Runs of the accepted offers. planned: of the plan, which must have other names.

    Raises InputError where a trial file is invalid, or where the plan has a trial of the same name.
    """
    names = {run.trial for run in planned}
    return tuple(_run(one, names) for one in offers(folder) if one.answer == "accepted")


def _run(offer: Offer, names: set[str]) -> PlannedRun:
    tree = load_toml(offer.path)
    parse(tree, TrialFile, where=str(offer.path))
    if offer.trial in names:
        raise InputError(
            "the plan has a trial of the same name as a designed one",
            where=str(offer.path),
            found=offer.trial,
            remedy="give the trial of the plan another name",
        )
    return PlannedRun(offer.trial, 1, 1, {**tree, "name": offer.trial})

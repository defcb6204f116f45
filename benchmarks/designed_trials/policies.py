"""Three ways to choose the next trial, each from what is still open."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slipbench.identification.experiments.envelope import draws
from slipbench.identification.experiments.family import menu_trials
from slipbench.identification.experiments.reading import (
    base_trials,
    known_of,
    problem_of,
    questions_of,
)
from slipbench.identification.experiments.search import SEED, THOROUGH, evaluated
from slipbench.identification.experiments.settling import Asked
from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem
from slipbench.next_command import designed_from, first_that_runs

STRAIGHT = 900.0  # m
Tree = dict[str, Any]


Choose = Callable[[Asked], Tree]
"""Content of the next trial file, from open questions. Raises InputError where no trial helps."""


@dataclass(frozen=True)
class Policy:
    """begin: makes, for a folder, what chooses the trials of a day that lie in it."""

    name: str
    begin: Callable[[Path], Choose]


def designed(place: Path) -> Choose:
    """Trials with the most expected evidence (`slipbench next`)."""

    def choose(open_questions: Asked) -> Tree:
        return designed_from(
            open_questions.folder, open_questions.still_open, STRAIGHT, [], [], place, _quiet
        )[0]

    return choose


def from_menu(place: Path) -> Choose:
    """The trial of the fixed menu with the most expected evidence, within the same limits."""

    def choose(open_questions: Asked) -> Tree:
        opened = open_questions.still_open
        known = known_of(open_questions.folder, opened)
        assert isinstance(known.model.system, MotorcycleSystem)
        (base,) = base_trials(open_questions.folder, opened, [])
        questions = questions_of(opened, (), known.model.system, str(open_questions.folder))
        problem = problem_of(known, questions, base, STRAIGHT)
        motorcycles = draws(known, problem.hypotheses, THOROUGH.drawn, SEED)
        trials = menu_trials(problem.motorcycle, problem.bounds, problem.actuators)
        found = [d for c in trials if (d := evaluated(problem, motorcycles, c)) is not None]
        found.sort(key=lambda d: -d.evidence.worth)
        return first_that_runs([(d, base, problem) for d in found], place, _quiet)[0]

    return choose


def planned(trees: tuple[Tree, ...]) -> Policy:
    """The trials of the plan, repeated in their order."""

    def begin(_: Path) -> Choose:
        again = itertools.cycle(trees)
        return lambda _asked: next(again)

    return Policy("fixed plan", begin)


def _quiet(_: str) -> None:
    pass

"""Questions of a session that designed trials are to settle, and the evidence of these trials.

The questions are those of the analysis of the planned runs, and stay the same: an e-value is about
hypotheses that were stated before the runs. Each designed run is predicted under each hypothesis from
the recordings of that analysis and the designed runs before it.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from slipbench.identification.experiments.hypothesis import NOTHING, stated
from slipbench.identification.experiments.prediction import run_evidence
from slipbench.identification.experiments.sequential_test import (
    LEVEL,
    RunEvidence,
    log_e_values,
    settled,
    standing,
)
from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem
from slipbench.identification.mismatch.reporting.open_questions import OpenQuestions
from slipbench.identification.mismatch.simulation.piece import Piece


@dataclass(frozen=True)
class Asked:
    """Questions with their evidence: of each designed run, one entry for each question.

    opened: paths in it lead from `folder`
    """

    opened: OpenQuestions
    folder: Path
    evidence: tuple[tuple[RunEvidence, ...], ...] = ()

    @property
    def names(self) -> tuple[tuple[str, ...], ...]:
        """Names of the hypotheses of each question."""
        return tuple(tuple(one.effect for one in each) for each in self.opened.questions)

    def of(self, number: int) -> tuple[RunEvidence, ...]:
        """Evidence of all runs for a question, counted from 0."""
        return tuple(run[number] for run in self.evidence)

    @property
    def settled(self) -> bool:
        """Whether at most one hypothesis of every question stands."""
        return all(settled(names, self.of(i)) for i, names in enumerate(self.names))

    @property
    def still_open(self) -> OpenQuestions:
        """Questions that are not settled, with the hypotheses that stand."""
        found = []
        for i, question in enumerate(self.opened.questions):
            remaining = standing(self.names[i], self.of(i))
            if len(remaining) > 1:
                found.append(tuple(one for one in question if one.effect in remaining))
        return self.opened.model_copy(update={"questions": tuple(found)})


def first_questions(opened: OpenQuestions, analysis: Path, folder: Path) -> OpenQuestions:
    """Questions of an analysis with paths that lead from another folder.

    Every effect in question is contested: a vehicle that has it already would decide the question.
    """

    def from_folder(path: str) -> str:
        return os.path.relpath((analysis / path).resolve(), folder.resolve())

    effects = {one.effect for each in opened.questions for one in each} - {NOTHING}
    return opened.model_copy(
        update={
            "vehicle": from_folder(opened.vehicle),
            "improved": from_folder(opened.improved),
            "runs": tuple(from_folder(run) for run in opened.runs),
            "contested": tuple(sorted(effects | set(opened.contested))),
        }
    )


def evidence_of(
    open_questions: Asked, earlier: Sequence[Path], run: Path
) -> tuple[RunEvidence, ...]:
    """Evidence of a designed run for each question. earlier: run folders of those before it.

    Raises InputError where a recording cannot be used.
    """
    system = _before(open_questions)
    where = str(open_questions.folder)
    questions = [
        [stated(one, system.library, where) for one in each]
        for each in open_questions.opened.questions
    ]
    paths = [*(open_questions.folder / name for name in open_questions.opened.runs), *earlier]
    records = [system.prepare(Piece.of(path).read()) for path in (*paths, run)]
    return run_evidence(system, records[:-1], records[-1], questions)


def _before(open_questions: Asked) -> MotorcycleSystem:
    """The nominal vehicle with its own uncertainties, and the accepted effects not in question.

    The parameters of the improved vehicle are not used: the recordings that they were fitted to are
    fitted again, and would count twice.
    """
    nominal = MotorcycleSystem.load(open_questions.folder / open_questions.opened.vehicle)
    improved = MotorcycleSystem.load(open_questions.folder / open_questions.opened.improved)
    own = {effect.key for effect in nominal.effects}
    new = [e for e in improved.effects if e.key not in own]
    effects = [e for e in (*nominal.effects, *new) if e.key not in open_questions.opened.contested]
    bike = replace(nominal.vehicle.motorcycle, effects=tuple(effects))
    return replace(nominal, vehicle=replace(nominal.vehicle, motorcycle=bike))


def lines_of(open_questions: Asked) -> tuple[str, ...]:
    """Evidence on each question, one line each."""
    return tuple(_line(names, open_questions.of(i)) for i, names in enumerate(open_questions.names))


def _line(names: Sequence[str], runs: Sequence[RunEvidence]) -> str:
    values = log_e_values(names, runs)
    remaining = standing(names, runs)
    against = ", ".join(f"{_words(name)} {_e_value(values[name])}" for name in names)
    if len(remaining) == 1:
        result = f"{_words(remaining[0])} stands, the others are rejected"
    elif remaining:
        result = f"open: {' or '.join(map(_words, remaining))}"
    else:
        result = "all are rejected: something else is missing"
    return f"{result} (e-values against: {against}; rejected from {1 / LEVEL:.0f} on)"


def _words(name: str) -> str:
    return name.replace("_", " ")


def _e_value(logarithm: float) -> str:
    """An e-value with two digits; far from one as a power of ten."""
    if abs(logarithm) < np.log(1e4):
        return f"{np.exp(logarithm):.2g}"
    return f"1e{logarithm / np.log(10.0):+.0f}"


def evidence_tree(evidence: Sequence[Sequence[RunEvidence]]) -> list[list[dict[str, Any]]]:
    """Evidence as JSON."""
    return [
        [{"run": one.run, "log_density": dict(one.log_density), "power": one.power} for one in run]
        for run in evidence
    ]


def evidence_from(
    tree: Sequence[Sequence[Mapping[str, Any]]],
) -> tuple[tuple[RunEvidence, ...], ...]:
    """Evidence from the tree that `evidence_tree` made."""
    return tuple(
        tuple(RunEvidence(one["run"], one["log_density"], one["power"]) for one in run)
        for run in tree
    )

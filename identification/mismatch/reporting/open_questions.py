"""Open questions of an analysis, for the design of the next trial: the file hypotheses.json.

version     version of this format
vehicle     vehicle file of the nominal simulation, relative to this file
improved    the improved vehicle file
runs        recordings of the analysis, relative to this file, with the segments used
contested   effects of the improved file that are only one of several indistinguishable hypotheses
questions   sets of mutually exclusive hypotheses: indistinguishable effects, or "nothing" and an
            effect that was not excited. dials: size in typical sizes and shapes in prior
            deviations; whole: values of integer parameters; spread: standard deviation of the
            size, in typical sizes
"""

import json
import os
from pathlib import Path

from pydantic import Field

from slipbench.identification.mismatch.analysis import Analysis, equivalents, not_excited
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.naming.interval import deviations
from slipbench.identification.mismatch.naming.named import Named
from slipbench.identification.mismatch.naming.plausibility import SENSORS
from slipbench.protocol.configuration import Section, parse
from slipbench.protocol.errors import InputError
from slipbench.protocol.user_file import read_user_file

NAME = "hypotheses.json"
VERSION = 1
LARGEST = 1_000_000  # bytes
MOST_HIDDEN = 6
"""Maximum number of not excited effects for which one trial is designed.

Physical effects come before sensor faults, which are rarer and hardly depend on the excitation;
within each, those with the largest expected log-likelihood gain in these recordings come first.
"""
TYPICAL_SPREAD = 0.5
"""Standard deviation of a size that is not identifiable, in typical sizes."""


class StatedHypothesis(Section):
    """One hypothesis: an effect by its name with its subject, or "nothing"."""

    effect: str
    dials: tuple[float, ...] = ()
    whole: tuple[float, ...] = ()
    spread: float = Field(default=0.0, ge=0.0)


class OpenQuestions(Section):
    """Content of hypotheses.json; see the docstring of this module."""

    version: int = VERSION
    vehicle: str
    improved: str
    runs: tuple[str, ...]
    contested: tuple[str, ...] = ()
    questions: tuple[tuple[StatedHypothesis, ...], ...] = ()


def open_questions_text(a: Analysis, vehicle: Path, folder: Path) -> str:
    """Return the text of hypotheses.json. vehicle: its file; folder: of hypotheses.json."""
    assert a.named is not None
    questions, contested = _questions(a.named)
    open_questions = OpenQuestions(
        vehicle=os.path.relpath(vehicle, folder),
        improved=f"{vehicle.stem}.improved.toml",
        runs=tuple(os.path.relpath(run, folder) for run in a.runs),
        contested=contested,
        questions=questions,
    )
    return json.dumps(open_questions.model_dump(), indent=1) + "\n"


def read_open_questions(path: Path) -> OpenQuestions:
    """Read hypotheses.json. Raises InputError that names the file and each key at fault."""
    try:
        tree = json.loads(read_user_file(path, LARGEST))
    except (ValueError, RecursionError) as cause:
        raise InputError("not valid JSON", where=str(path), found=str(cause)) from cause
    if not isinstance(tree, dict):
        raise InputError("not valid", where=str(path), expected="a table", found=str(type(tree)))
    open_questions = parse(tree, OpenQuestions, where=str(path))
    if open_questions.version != VERSION:
        raise InputError(
            "another version of this form",
            where=str(path),
            expected=str(VERSION),
            found=str(open_questions.version),
            remedy="analyse again with this version of slipbench",
        )
    return open_questions


def _questions(named: Named) -> tuple[tuple[tuple[StatedHypothesis, ...], ...], tuple[str, ...]]:
    """Return the questions, and the effects of the fit that they contest."""
    by_name = {s.candidate.name: s.candidate for s in named.scores}
    accepted = {c.name: _as_fitted(named.fit, i) for i, c in enumerate(named.fit.effects)}
    hypothesis_by_name = {name: _as_screened(c) for name, c in by_name.items()} | accepted
    questions = [
        [hypothesis_by_name[n] for n in names if n in hypothesis_by_name]
        for names in equivalents(named)
    ]
    questions = [question for question in questions if len(question) > 1]
    if questions:
        return tuple(map(tuple, questions)), tuple(
            h.effect for question in questions for h in question if h.effect in accepted
        )
    nothing = StatedHypothesis(effect="nothing")
    return tuple((nothing, _at_typical_size(c)) for c in _not_excited_candidates(named)), ()


def _not_excited_candidates(named: Named) -> list[Candidate]:
    """Return the not excited effects for which a trial is designed, in order of priority."""
    not_excited_names = set(not_excited(named))
    scores = [s for s in named.scores if s.candidate.name in not_excited_names]
    scores.sort(key=lambda s: (s.candidate.kind.block in SENSORS, -s.typical))
    return [s.candidate for s in scores[:MOST_HIDDEN]]


def _at_typical_size(candidate: Candidate) -> StatedHypothesis:
    """Return the effect at its typical size, since the best trial hardly depends on its size."""
    return StatedHypothesis(
        effect=candidate.name, dials=(1.0, *candidate.parameters[1:]), whole=candidate.integers
    )


def _as_screened(candidate: Candidate) -> StatedHypothesis:
    return StatedHypothesis(
        effect=candidate.name,
        dials=candidate.parameters,
        whole=candidate.integers,
        spread=TYPICAL_SPREAD * abs(candidate.size),
    )


def _as_fitted(fit: Fit, number: int) -> StatedHypothesis:
    candidate = fit.effects[number]
    parameter_number = sum(
        len(c.parameters) for c in fit.candidates[: fit.candidates.index(candidate)]
    )
    spread = float(deviations(fit)[0][parameter_number])
    return StatedHypothesis(
        effect=candidate.name, dials=candidate.parameters, whole=candidate.integers, spread=spread
    )

"""What an analysis left open, as a file from which the next trial is designed: hypotheses.json.

version     of this form
vehicle     vehicle file of the nominal simulation, relative to this file
improved    the improved vehicle file
runs        recordings of the analysis, relative to this file, with the segments used
contested   effects of the improved file that are not certain: one of the hypotheses
questions   sets of hypotheses that exclude each other: effects that the recordings cannot tell apart, or
            "nothing" and an effect that they would not have shown. dials: size in typical sizes and
            shapes in prior deviations; whole: values of whole parameters; spread: standard deviation of
            the size, in typical sizes
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
"""Effects that were not excited, for which one trial is designed: it cannot show all of the library.

Physics before faults of sensors, which are rarer and hardly depend on the excitation; then those that
the recordings would nearly have shown.
"""
TYPICAL_SPREAD = 0.5
"""Standard deviation of a size of which recordings say nothing, in typical sizes."""


class StatedHypothesis(Section):
    """One hypothesis: an effect by its name with its subject, or "nothing"."""

    effect: str
    dials: tuple[float, ...] = ()
    whole: tuple[float, ...] = ()
    spread: float = Field(default=0.0, ge=0.0)


class OpenQuestions(Section):
    """Content of hypotheses.json; see the head of this file."""

    version: int = VERSION
    vehicle: str
    improved: str
    runs: tuple[str, ...]
    contested: tuple[str, ...] = ()
    questions: tuple[tuple[StatedHypothesis, ...], ...] = ()


def open_questions_text(a: Analysis, vehicle: Path, folder: Path) -> str:
    """Text of hypotheses.json of an analysis of a vehicle; folder: in which it lies."""
    assert a.named is not None
    asked, contested = _questions(a.named)
    found = OpenQuestions(
        vehicle=os.path.relpath(vehicle, folder),
        improved=f"{vehicle.stem}.improved.toml",
        runs=tuple(os.path.relpath(run, folder) for run in a.runs),
        contested=contested,
        questions=asked,
    )
    return json.dumps(found.model_dump(), indent=1) + "\n"


def read_open_questions(path: Path) -> OpenQuestions:
    """Read hypotheses.json. Raises InputError that names the file and each key at fault."""
    try:
        tree = json.loads(read_user_file(path, LARGEST))
    except (ValueError, RecursionError) as cause:
        raise InputError("not valid JSON", where=str(path), found=str(cause)) from cause
    if not isinstance(tree, dict):
        raise InputError("not valid", where=str(path), expected="a table", found=str(type(tree)))
    found = parse(tree, OpenQuestions, where=str(path))
    if found.version != VERSION:
        raise InputError(
            "another version of this form",
            where=str(path),
            expected=str(VERSION),
            found=str(found.version),
            remedy="analyse again with this version of slipbench",
        )
    return found


def _questions(named: Named) -> tuple[tuple[tuple[StatedHypothesis, ...], ...], tuple[str, ...]]:
    """Questions, and effects of the fit that are contested by them."""
    by_name = {s.candidate.name: s.candidate for s in named.scores}
    accepted = {c.name: _fitted(named.fit, i) for i, c in enumerate(named.fit.effects)}
    known = {name: _typical(c) for name, c in by_name.items()} | accepted
    sets = [[known[n] for n in names if n in known] for names in equivalents(named)]
    sets = [one for one in sets if len(one) > 1]
    if sets:
        return tuple(map(tuple, sets)), tuple(
            h.effect for one in sets for h in one if h.effect in accepted
        )
    nothing = StatedHypothesis(effect="nothing")
    return tuple((nothing, _alone(c)) for c in _hidden(named)), ()


def _hidden(named: Named) -> list[Candidate]:
    """Effects that were not excited, those first for which a trial should be designed."""
    names = set(not_excited(named))
    scores = [s for s in named.scores if s.candidate.name in names]
    scores.sort(key=lambda s: (s.candidate.kind.block in SENSORS, -s.typical))
    return [s.candidate for s in scores[:MOST_HIDDEN]]


def _alone(candidate: Candidate) -> StatedHypothesis:
    """The effect at its typical size: whatever its size, the trial that shows it is nearly the same."""
    return StatedHypothesis(
        effect=candidate.name, dials=(1.0, *candidate.parameters[1:]), whole=candidate.integers
    )


def _typical(candidate: Candidate) -> StatedHypothesis:
    return StatedHypothesis(
        effect=candidate.name,
        dials=candidate.parameters,
        whole=candidate.integers,
        spread=TYPICAL_SPREAD * abs(candidate.size),
    )


def _fitted(fit: Fit, number: int) -> StatedHypothesis:
    candidate = fit.effects[number]
    place = sum(len(c.parameters) for c in fit.candidates[: fit.candidates.index(candidate)])
    spread = float(deviations(fit)[0][place])
    return StatedHypothesis(
        effect=candidate.name, dials=candidate.parameters, whole=candidate.integers, spread=spread
    )

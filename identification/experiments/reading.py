"""Result of an analysis, read from its folder: vehicle, noise, hypotheses, limits."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from slipbench.identification.experiments.bounds import Bounds
from slipbench.identification.experiments.hypothesis import Hypothesis, hypotheses_of, stated
from slipbench.identification.experiments.search import Problem
from slipbench.identification.mismatch.fit.calibrate import start_fit
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.fit.sensitivity import none
from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem
from slipbench.identification.mismatch.reporting.open_questions import (
    NAME,
    OpenQuestions,
    read_open_questions,
)
from slipbench.identification.mismatch.simulation.model import models, predict
from slipbench.identification.mismatch.simulation.piece import Piece
from slipbench.protocol.configuration import load_toml, parse
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.run_folder import TRIAL, VEHICLE
from slipbench.protocol.shipped_files import file_or_shipped
from slipbench.protocol.trial_file import TrialFile

MEMO = "memo"
"""Folder of the analysis inside the folder of a session."""
MOST_RUNS = 4
"""Recordings from which the noise is estimated: further ones hardly improve the estimate."""


@dataclass(frozen=True)
class BaseTrial:
    """A trial file whose limits hold for the design.

    tree: its content; path: where it lies; vehicle: its vehicle file, of a recording the copy in it
    """

    path: Path
    tree: dict[str, Any]
    trial: TrialFile
    vehicle: Path


def questions_in(folder: Path) -> tuple[Path, OpenQuestions]:
    """Folder of an analysis and what it left open. folder: of `explain --report`, or of a session.

    Raises InputError where there is no analysis.
    """
    for place in (folder, folder / MEMO):
        if (place / NAME).is_file():
            return place, read_open_questions(place / NAME)
    raise InputError(
        "no analysis lies in this folder",
        where=str(folder),
        expected=f"{NAME}, or {MEMO}/{NAME}",
        remedy="run `slipbench explain ... --report FOLDER`, or `slipbench session ... --explain FILE`",
    )


def known_of(place: Path, opened: OpenQuestions) -> Fit:
    """The improved vehicle without the effects in question, with the noise of its recordings.

    Raises InputError where a file or a recording cannot be used.
    """
    improved = MotorcycleSystem.load(place / opened.improved)
    if not opened.runs:
        raise InputError("no recording is named", where=str(place / NAME))
    records = [improved.prepare(Piece.of(place / r).read()) for r in opened.runs[:MOST_RUNS]]
    (model,) = models(improved, records)
    noise = optimize(start_fit(model.coarse, model.origin())).noise  # the file is calibrated
    (bare,) = models(_without(improved, opened.contested), records)
    origin = bare.origin()
    return Fit(bare, origin, predict(bare, origin), noise, none(bare, origin))


def _without(system: MotorcycleSystem, contested: Sequence[str]) -> MotorcycleSystem:
    bike = system.vehicle.motorcycle
    kept = tuple(effect for effect in bike.effects if effect.key not in contested)
    return replace(system, vehicle=replace(system.vehicle, motorcycle=replace(bike, effects=kept)))


def questions_of(
    opened: OpenQuestions, between: Sequence[str], system: MotorcycleSystem, where: str
) -> tuple[tuple[Hypothesis, ...], ...]:
    """Sets of hypotheses: those named in `between`, else those that the analysis left open.

    Raises InputError where nothing is open.
    """
    if between:
        return (hypotheses_of(between, system.library, "--between"),)
    found = tuple(
        tuple(stated(one, system.library, where) for one in question)
        for question in opened.questions
    )
    if found:
        return found
    raise InputError(
        "the analysis left nothing open: no effects that it could not tell apart, and none that the"
        " recordings would not have shown",
        where=where,
        remedy="name hypotheses yourself: --between backlash,hardening_cush or --between nothing,backlash",
    )


def base_trials(place: Path, opened: OpenQuestions, named: Sequence[Path]) -> tuple[BaseTrial, ...]:
    """Trial files whose limits hold: those named, else those of the recordings, each set once.

    Raises InputError where there is none.
    """
    paths = [*named] or [Piece.of(place / run).folder / TRIAL for run in opened.runs]
    found = dict[str, BaseTrial]()
    for path in paths:
        if named or path.is_file():
            tree = load_toml(path)
            trial = parse(tree, TrialFile, where=str(path), recorded=not named)
            vehicle = path.with_name(VEHICLE)
            if named:
                vehicle = file_or_shipped(trial.vehicle, "vehicle", folder=path.parent)
            found.setdefault(repr(trial.limits), BaseTrial(path, tree, trial, vehicle))
    if found:
        return tuple(found.values())
    raise InputError(
        "none of the recordings has a trial file, so no limits are known",
        where=str(place),
        remedy="name a trial file whose limits hold: --trial FILE",
    )


def problem_of(
    known: Fit, questions: tuple[tuple[Hypothesis, ...], ...], base: BaseTrial, straight: float
) -> Problem:
    """Design problem inside the limits of a trial on a straight (m)."""
    bounds = Bounds(base.trial.limits, straight, float(base.trial.command.period))
    return Problem(known, questions, bounds)

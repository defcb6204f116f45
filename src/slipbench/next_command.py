"""The command `next`: the trial that settles what an analysis left open. It joins bench and identification."""

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from slipbench.protocol.errors import InputError

if TYPE_CHECKING:  # the analyses take seconds to import; --help should not
    from slipbench.identification.experiments.envelope import Drawn
    from slipbench.identification.experiments.reading import BaseTrial
    from slipbench.identification.experiments.search import Designed, Problem
    from slipbench.identification.mismatch.reporting.open_questions import OpenQuestions

LOWER = 0.75  # from one amplitude to the next
ATTEMPTS = 4  # amplitudes that are run before a trial is given up
ON_THE_BENCH = 4  # motorcycles at most: those of the simulation before are many more
SEED = 77


def register(app: typer.Typer) -> None:
    """Add `next` to the one command."""
    app.command("next")(next_command)


def next_command(
    folder: Annotated[
        Path, typer.Argument(help="Folder of `explain --report` or of a session.", metavar="FOLDER")
    ],
    straight: Annotated[str, typer.Option(help="Length of the straight, as in 900m.")],
    trial: Annotated[
        list[Path] | None,
        typer.Option(help="Trial file whose limits hold; default: those of the recordings."),
    ] = None,
    between: Annotated[
        str,
        typer.Option(
            help="Hypotheses, with commas: effects, or `nothing`; default: what the analysis left open."
        ),
    ] = "",
    out: Annotated[
        Path | None, typer.Option(help="New trial file; default: designed_trial.toml in FOLDER.")
    ] = None,
) -> None:
    """Design the trial that settles what the analysis left open.

    Hypotheses are effects that the recordings cannot tell apart, or effects that they would not have
    shown. Waveform, amplitude, band, gear and engine speed are those with the largest expected
    log-likelihood ratio, after the parameters of the vehicle and of the effects have been fitted.
    The limits are those of the recorded trials. Before it is offered, the trial is simulated with
    motorcycles drawn within their intervals, in narrower limits, and run on the simulated bench.

    Exit status: 0 done, 2 invalid input (see message).

    Example: slipbench next monday --straight 900m --out next.toml
    """
    import tomli_w

    from slipbench.bench.session.straight import length_of
    from slipbench.protocol.new_file import new_file, refuse_existing

    length = length_of(straight)
    path = out or folder / "designed_trial.toml"
    refuse_existing(path)
    names = [name.strip() for name in between.split(",") if name.strip()]
    tree, text = designed_trial(folder, length, trial or [], names, path.parent, _to_stderr)
    with new_file(path) as draft:
        draft.write_text(tomli_w.dumps(tree), encoding="utf-8")
    typer.echo(text)
    typer.echo(f"run it: slipbench trial {path}")


def designed_trial(
    folder: Path,
    straight: float,
    trials: list[Path],
    between: list[str],
    place: Path,
    say: Callable[[str], None],
) -> tuple[dict[str, Any], str]:
    """Content of the trial file, which will lie in `place`, and what the trial is to show.

    folder: of an analysis or session; straight: m; trials: files whose limits hold; between: names of
    hypotheses. Raises InputError where nothing is open, or where no trial stays within the limits.
    """
    from slipbench.identification.experiments.reading import questions_in

    return designed_from(*questions_in(folder), straight, trials, between, place, say)


def designed_from(
    analysis: Path,
    opened: "OpenQuestions",
    straight: float,
    trials: list[Path],
    between: list[str],
    place: Path,
    say: Callable[[str], None],
) -> tuple[dict[str, Any], str]:
    """The same from open questions whose paths lead from the folder `analysis`."""
    from slipbench.identification.experiments.offer import sentence
    from slipbench.identification.experiments.reading import (
        base_trials,
        known_of,
        problem_of,
        questions_of,
    )
    from slipbench.identification.experiments.search import design
    from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem

    bases = base_trials(analysis, opened, trials)
    say("Reading recordings")
    known = known_of(analysis, opened)
    assert isinstance(known.model.system, MotorcycleSystem)
    asked = questions_of(opened, between, known.model.system, str(analysis))
    found: list[tuple[Designed, BaseTrial, Problem]] = []
    for base in bases:
        problem = problem_of(known, asked, base, straight)
        found += [(one, base, problem) for one in design(problem, say)]
    found.sort(key=lambda each: -each[0].evidence.worth)
    tree, designed = first_that_runs(found, place, say)
    return tree, sentence(designed)


def first_that_runs(
    found: "list[tuple[Designed, BaseTrial, Problem]]", place: Path, say: Callable[[str], None]
) -> "tuple[dict[str, Any], Designed]":
    """The first trial that all motorcycles end on the bench. Raises InputError where none does."""
    why = "no operating point and waveform stay within them"
    for designed, base, problem in found:
        for _ in range(ATTEMPTS):
            why, tree = _why_not(designed, base, problem, place)
            say(f"{designed.choice}: {why or 'inside the limits, with margin'}")
            if not why:
                return tree, designed
            smaller = _smaller(designed, problem)
            if smaller is None:
                break
            designed = smaller
    raise InputError(
        "no trial that would tell these hypotheses apart stays inside the limits",
        where=", ".join(dict.fromkeys(str(base.path) for _, base, _ in found)),
        found=why,
        remedy="give a longer straight, or another trial file whose limits the rider accepts: --trial",
    )


def _smaller(designed: "Designed", problem: "Problem") -> "Designed | None":
    """The same trial with a smaller amplitude, its evidence computed anew."""
    from slipbench.identification.experiments.envelope import draws, rounded
    from slipbench.identification.experiments.search import SEED as DRAWS
    from slipbench.identification.experiments.search import evaluated

    choice = designed.choice
    choice = replace(choice, amplitude=rounded(LOWER * choice.amplitude))
    return evaluated(problem, draws(problem.known, problem.hypotheses, 0, DRAWS), choice)


def _why_not(
    designed: "Designed", base: "BaseTrial", problem: "Problem", place: Path
) -> tuple[str, dict[str, Any]]:
    """Why the trial does not end with one of the motorcycles, "" where it does; and its file."""
    from slipbench.bench.session.margin_check import narrower
    from slipbench.identification.experiments.envelope import draws
    from slipbench.identification.experiments.offer import trial_of

    bike, choice = problem.motorcycle, designed.choice
    speed = choice.engine_speed * bike.rear_wheel.radius / bike.gears[choice.gear - 1]
    tree = trial_of(designed, base, problem.bounds.straight_left(speed), place)
    likely, *others = draws(problem.known, problem.hypotheses, 1, SEED)
    drawn_ones = others[-len(problem.hypotheses) :]  # the last are those within the intervals
    for drawn in (likely, *drawn_ones)[:ON_THE_BENCH]:
        why = _trip_with(drawn, narrower(tree), problem)
        if why:
            return why, tree
    return "", tree


def _trip_with(drawn: "Drawn", tree: dict[str, Any], problem: "Problem") -> str:
    """Why the trial does not end on the simulated bench with a motorcycle; "" where it does."""
    from slipbench.bench.session.margin_check import trip_of
    from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem
    from slipbench.plant.vehicle_writer import save_vehicle

    system = problem.known.model.system
    assert isinstance(system, MotorcycleSystem)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "vehicle.toml"
        save_vehicle(replace(system.vehicle, motorcycle=drawn.motorcycle), path)
        point = dict(tree["operating_point"])
        rpm = float(point["engine_speed"].split()[0]) * (1.0 + drawn.off)
        point["engine_speed"] = f"{rpm:.0f} rpm"
        try:
            return trip_of({**tree, "vehicle": str(path), "operating_point": point})
        except InputError as fault:
            return fault.what


def _to_stderr(line: str) -> None:
    typer.echo(line, err=True)

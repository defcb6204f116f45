"""A day: planned trials, then trials of a policy until one hypothesis stands.

What is true is in the vehicle file of the virtual motorcycle alone. The policies see recordings, the
nominal vehicle file, and the hypotheses.
"""

import json
import math
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import tomli_w

from benchmarks.designed_trials.case import Case, UnsuitableError, draw_case
from benchmarks.designed_trials.policies import Policy, Tree, designed, from_menu, planned
from slipbench.bench.trials.preparation import prepare
from slipbench.bench.trials.run import run_trial
from slipbench.identification.closed_loop_simulation.drawn_motorcycles import within_deviations
from slipbench.identification.experiments.evidence import rehearsed
from slipbench.identification.experiments.hypothesis import NOTHING, Hypothesis
from slipbench.identification.experiments.sequential_test import standing
from slipbench.identification.experiments.settling import Asked, evidence_of
from slipbench.identification.mismatch.analysis import begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.motorcycle.menu import RPM, Choice, excitation_table
from slipbench.identification.mismatch.motorcycle.system import MotorcycleSystem
from slipbench.identification.mismatch.reporting.improved import improved_system
from slipbench.identification.mismatch.reporting.open_questions import (
    OpenQuestions,
    StatedHypothesis,
)
from slipbench.identification.mismatch.simulation.piece import Piece
from slipbench.plant.vehicle_file import Vehicle, load_vehicle
from slipbench.plant.vehicle_writer import save_vehicle
from slipbench.plant.vehicles import NOMINAL
from slipbench.protocol.errors import InputError
from slipbench.protocol.straight import AFTERWARDS, BEFORE
from slipbench.protocol.units import parse_quantity

MOST = 6
"""Trials of a policy after the planned ones."""
FIRST_SEED = 100
LIMITS = {
    "throttle": ["0.5 %", "30 %"],
    "throttle_deviation": "6 %",
    "throttle_rate": "600 %/s",
    "spark": ["-10 deg", "10 deg"],
    "spark_rate": "1000 deg/s",
    "engine_speed": ["7000 rpm", "15500 rpm"],
    "speed": ["20 m/s", "75 m/s"],
    "slip": "8 %",
    "distance": "900 m",
}
BAND, SECONDS = (0.5, 12.0), 10.0  # of the planned sweeps: Hz, s
GEARS, SPEEDS = (2, 3), (9000.0, 13000.0)
"""Of the planned sweeps; engine speeds in rpm."""
AMPLITUDES = {"throttle": 0.02, "spark": math.radians(8.0)}
LEAST = 0.5
"""Of these amplitudes, at least: the first trials of a day are cautious."""


@dataclass(frozen=True)
class Day:
    """Cost of a policy. runs: trials after the planned ones; seconds: of riding in them.

    left: hypotheses that stand at the end; trips: runs that a limit ended; why: it ended early.
    """

    policy: str
    runs: int
    seconds: float
    left: tuple[str, ...]
    trips: int = 0
    why: str = ""


@dataclass(frozen=True)
class Result:
    """A case under every policy. processor: s; why: it was not ridden, empty where it was."""

    number: int
    names: tuple[str, ...]
    truth: str
    days: tuple[Day, ...]
    processor: float
    why: str = ""

    @classmethod
    def read(cls, text: str) -> "Result":
        """Result from the JSON that `written` gives."""
        tree = json.loads(text)
        days = tuple(Day(**{**day, "left": tuple(day["left"])}) for day in tree["days"])
        return cls(**{**tree, "names": tuple(tree["names"]), "days": days})

    def written(self) -> str:
        """Result as JSON."""
        return json.dumps(asdict(self), indent=1) + "\n"


def result(seed: int, number: int, folder: Path) -> Result:
    """Draw a case and spend a day on it under each policy. folder: a new one, for its recordings."""
    try:
        return _result(seed, number, folder)
    except UnsuitableError as fault:
        return Result(number, (), "", (), 0.0, str(fault))


def _result(seed: int, number: int, folder: Path) -> Result:
    began = time.process_time()
    nominal, rng = load_vehicle(NOMINAL), np.random.default_rng((seed, number))
    bike = within_deviations(nominal, rng)
    folder.mkdir(parents=True)
    plan = _drawn_plan(rng)
    trees = tuple(_planned(folder, choice) for choice in plan)
    as_file = replace(nominal, motorcycle=bike)
    _ride_plan(folder, as_file, trees, "without")
    known = _calibrated(folder, [f"without_{i}" for i in range(len(trees))])
    case = draw_case(rng, [rehearsed(known, choice) for choice in plan], number % 2 == 0)
    hidden = replace(as_file, motorcycle=replace(bike, effects=(*bike.effects, *case.effects)))
    _ride_plan(folder, hidden, trees, "planned")
    open_questions = _open_questions(case, folder, [f"planned_{i}" for i in range(len(trees))])
    policies = (Policy("designed", designed), Policy("menu", from_menu), planned(trees))
    days = tuple(_day(policy, open_questions, folder) for policy in policies)
    return Result(number, case.names, case.truth, days, time.process_time() - began)


def _ride_plan(folder: Path, vehicle: Vehicle, trees: Sequence[Tree], name: str) -> None:
    """Ride the planned trials. Raises UnsuitableError where one trips."""
    save_vehicle(vehicle, folder / "motorcycle.toml")
    for i, tree in enumerate(trees):
        if why := _ride(folder, f"{name}_{i}", {**tree, "seed": i + 1}):
            raise UnsuitableError(f"a planned trial tripped: {why}")


def _calibrated(folder: Path, runs: Sequence[str]) -> Fit:
    """The nominal vehicle fitted to recordings."""
    system = MotorcycleSystem.load(NOMINAL)
    records = [system.prepare(Piece.of(folder / run).read()) for run in runs]
    known = analyse(begin(system, records, []), until=1).base
    assert known is not None
    return known


def _drawn_plan(rng: np.random.Generator) -> list[Choice]:
    """A sweep of the throttle and one of the spark about one operating point."""
    gear, speed = int(rng.choice(GEARS)), round(float(rng.uniform(*SPEEDS)), -2) * RPM
    share = float(rng.uniform(LEAST, 1.0))
    return [
        Choice(gear, speed, actuator, "linear_sweep", share * most, *BAND, SECONDS)
        for actuator, most in AMPLITUDES.items()
    ]


def _planned(folder: Path, choice: Choice) -> Tree:
    return {
        "name": f"{choice.actuator}_sweep",
        "description": str(choice),
        "vehicle": str(folder / "motorcycle.toml"),
        "operating_point": {
            "gear": choice.gear,
            "engine_speed": f"{choice.engine_speed / RPM:.0f} rpm",
            "engine_speed_window": "400 rpm",
            "steady_for": "500 ms",
        },
        "excitation": excitation_table(choice),
        "limits": LIMITS,
    }


def _open_questions(case: Case, folder: Path, runs: Sequence[str]) -> Asked:
    """The question of the case beside its planned recordings, and the re-calibrated vehicle file."""
    improved = improved_system(_calibrated(folder, runs))
    assert isinstance(improved, MotorcycleSystem)
    save_vehicle(improved.vehicle, folder / "improved.toml")
    opened = OpenQuestions(
        vehicle=str(NOMINAL),
        improved="improved.toml",
        runs=tuple(runs),
        contested=tuple(h.name for h in case.question if h.name != NOTHING),
        questions=(tuple(map(_stated, case.question)),),
    )
    return Asked(opened, folder)


def _stated(one: Hypothesis) -> StatedHypothesis:
    if one.candidate is None:
        return StatedHypothesis(effect=NOTHING)
    parameters, integers = one.candidate.parameters, one.candidate.integers
    return StatedHypothesis(effect=one.name, dials=parameters, whole=integers, spread=one.spread)


def _day(policy: Policy, open_questions: Asked, folder: Path) -> Day:
    """Ride trials of a policy until one hypothesis stands, or MOST are ridden."""
    runs: list[Path] = []
    seconds, trips, ridden, why = 0.0, 0, 0, ""
    choose = policy.begin(folder)
    while ridden < MOST and not open_questions.settled:
        try:
            tree = choose(open_questions)
        except InputError as fault:
            why = str(fault)
            break
        ridden += 1
        run = folder / f"{policy.name.replace(' ', '_')}_{ridden}"
        tree = {**tree, "vehicle": str(folder / "motorcycle.toml"), "seed": FIRST_SEED + ridden}
        seconds += BEFORE + parse_quantity(tree["excitation"]["duration"], "s") + AFTERWARDS
        if _ride(folder, run.name, tree):
            trips += 1
            continue
        open_questions = replace(
            open_questions,
            evidence=(*open_questions.evidence, evidence_of(open_questions, runs, run)),
        )
        runs.append(run)
    left = standing(open_questions.names[0], open_questions.of(0))
    return Day(policy.name, ridden, seconds, left, trips, why)


def _ride(folder: Path, name: str, tree: Tree) -> str:
    """Ride a trial on the virtual motorcycle into a folder; why it tripped or cannot begin, else ""."""
    path = folder / f"{name}.toml"
    path.write_text(tomli_w.dumps({**tree, "name": name}), encoding="utf-8")
    try:
        outcome = run_trial(prepare(path), folder / name, None)
    except InputError as fault:
        return fault.what
    return "" if outcome.done else outcome.trip or "it did not end"

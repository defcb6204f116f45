"""A hidden case: a motorcycle with hidden effects, its vehicle file, and seven trials.

Everything follows from the seed of the study and the number of the case.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from slipbench.studies.blind_validation.generator.excitations import Excitation, draw_excitations
from slipbench.studies.blind_validation.generator.fault_parameters import MotionFaults
from slipbench.studies.blind_validation.generator.fault_type import OPTICAL, SERVO, FaultType
from slipbench.studies.blind_validation.generator.fault_types import (
    BY_NAME,
    LIBRARY,
    Hidden,
    draw_hidden,
)
from slipbench.studies.blind_validation.generator.filters import Filter, draw_filters
from slipbench.studies.blind_validation.generator.frames import Line
from slipbench.studies.blind_validation.generator.instruments import ChannelFaults, Disc, Sensors
from slipbench.studies.blind_validation.generator.outside import OUTSIDE
from slipbench.studies.blind_validation.generator.recording import FaultSet, Trial, write_run
from slipbench.studies.blind_validation.generator.road import Roughness
from slipbench.studies.blind_validation.generator.tyres import NAMES
from slipbench.studies.blind_validation.generator.vehicle_file import (
    Truth,
    draw_truth,
    vehicle_tree,
)

NOTHING, MODERATE, SMALL, PAIR, TRIPLE, ELSE, UNEXCITED = (
    "nothing",
    "moderate",
    "small",
    "pair",
    "triple",
    "outside",
    "unexcited",
)
ROUND = (
    NOTHING,
    MODERATE,
    NOTHING,
    SMALL,
    NOTHING,
    ELSE,
    NOTHING,
    PAIR,
    NOTHING,
    MODERATE,
    NOTHING,
    SMALL,
    NOTHING,
    TRIPLE,
    NOTHING,
    ELSE,
    NOTHING,
    MODERATE,
    NOTHING,
    UNEXCITED,
)
"""The sorts of case, repeated: however early a study ends, it is balanced."""
OTHER_TYRES = 0.5  # share of the cases whose tyre is no magic formula
CARELESS = 0.1  # share of the cases whose vehicle file errs by up to three deviations
SLOW = (1.0, 12.0)  # s, correlation times of wind and grade
REPEATED, LOST = 2e-3, 4e-3  # highest shares of frames that are sent twice, or lost


@dataclass(frozen=True)
class Case:
    """Ground truth and trials of a case. vehicle: tree of the file that is handed out.

    careless: its numbers err by up to three of their stated deviations.
    """

    number: int
    category: str
    truth: Truth
    hidden: tuple[Hidden, ...]
    vehicle: Mapping[str, Any]
    training: tuple[Trial, ...]
    held_out: tuple[Trial, ...]
    careless: bool = False

    @property
    def faults(self) -> FaultSet:
        """Hidden effects of the motorcycle, which its vehicle file lacks."""
        return secret_of(self.hidden)


def draw_case(seed: int, number: int) -> Case:
    """Case `number`, from 0, of a study."""
    rng = np.random.default_rng((seed, number))
    category = ROUND[number % len(ROUND)]
    formula = int(rng.integers(1, len(NAMES))) if rng.uniform() < OTHER_TYRES else 0
    truth = draw_truth(rng, formula)
    hidden = _hidden(rng, category, seed, number)
    truth = replace(truth, filters=_filters(rng, hidden))
    careless = bool(rng.uniform() < CARELESS)
    vehicle = vehicle_tree(rng, truth, careless)
    sets = draw_excitations(rng, gentle=category == UNEXCITED)
    rough, line = (
        _draw_roughness(rng),
        Line(*(float(rng.uniform(0.0, m)) for m in (REPEATED, LOST))),
    )
    training, held_out = (
        tuple(
            _trial(rng, f"{name}_{i + 1}", e, rough, line, (seed, number)) for i, e in enumerate(es)
        )
        for name, es in zip(("training", "held_out"), sets, strict=True)
    )
    return Case(number, category, truth, hidden, vehicle, training, held_out, careless)


def _filters(rng: np.random.Generator, hidden: Sequence[Hidden]) -> dict[str, Filter]:
    """Stated filters of the sensors; a sensor with a hidden effect has none."""
    taken = {h.subject for h in hidden}
    if any(h.places == (OPTICAL,) for h in hidden):
        taken.add("optical_speed")
    if any(SERVO in h.places for h in hidden):
        taken.add("throttle_position")
    return {name: chosen for name, chosen in draw_filters(rng).items() if name not in taken}


def _draw_roughness(rng: np.random.Generator) -> Roughness:
    """Disturbances of a case: wind and grade are as slow as what an analysis takes for slow."""
    low, high = np.log(SLOW)
    return Roughness(
        wind=float(rng.uniform(0.3, 1.0)),
        wind_time=float(np.exp(rng.uniform(low, high))),
        grade=float(rng.uniform(1e-3, 3e-3)),
        grade_time=float(np.exp(rng.uniform(low, high))),
        bump=float(rng.uniform(0.01, 0.025)),
        combustion=float(rng.uniform(0.02, 0.04)),
    )


def _trial(
    rng: np.random.Generator,
    name: str,
    excitation: Excitation,
    rough: Roughness,
    line: Line,
    origin: tuple[int, int],
) -> Trial:
    seed = (*origin, int(rng.integers(1 << 30)))
    return Trial(name, excitation, rough, seed, (*origin, 7), line)


def _hidden(rng: np.random.Generator, category: str, seed: int, number: int) -> tuple[Hidden, ...]:
    """Hidden effects of a case; over the cases of one category every fault type occurs in turn."""
    if category == NOTHING:
        return ()
    if category == UNEXCITED:
        kind = _turn(seed, category, number, [k for k in LIBRARY if k.needs])
        return (draw_hidden(rng, kind, "moderate"),)
    if category == ELSE:
        return (draw_hidden(rng, _turn(seed, category, number, OUTSIDE), "moderate"),)
    if category in (MODERATE, SMALL):
        return (draw_hidden(rng, _turn(seed, category, number, LIBRARY), category),)
    return _several(rng, 2 if category == PAIR else 3)


def _turn(seed: int, category: str, number: int, kinds: Sequence[FaultType]) -> FaultType:
    before = number // len(ROUND) * ROUND.count(category) + ROUND[: number % len(ROUND)].count(
        category
    )
    order = np.random.default_rng((seed, ROUND.index(category), 99)).permutation(len(kinds))
    return kinds[int(order[before % len(kinds)])]


def _several(rng: np.random.Generator, count: int) -> tuple[Hidden, ...]:
    """Several effects at different injection points, all of them visible."""
    found: list[Hidden] = []
    loud = [k for k in LIBRARY if not k.quiet]
    while len(found) < count:
        new = draw_hidden(rng, loud[int(rng.integers(len(loud)))], "moderate")
        if not {p for f in found for p in f.places} & set(new.places):
            found.append(new)
    return tuple(found)


def secret_of(hidden: Sequence[Hidden]) -> FaultSet:
    """Parameters of the hidden effects, as motorcycle and sensors take them."""
    motion: dict[str, float] = {}
    channels: dict[str, dict[str, float]] = {}
    discs: dict[str, dict[str, float]] = {}
    for one in hidden:
        kind = BY_NAME[one.kind]
        fields = {name: to for name, (to, *_) in {**kind.sizes, **kind.shapes, **kind.own}.items()}
        values = {fields[name]: value for name, value in one.parameters.items()}
        if one.subject.endswith("_encoder"):
            discs.setdefault(one.subject.removesuffix("_encoder"), {}).update(values)
        elif one.subject:
            channels.setdefault(one.subject, {}).update(values)
        else:
            motion |= values
    return FaultSet(
        MotionFaults(**motion),
        Sensors(
            {name: ChannelFaults(**v) for name, v in channels.items()},
            {name: _disc(v) for name, v in discs.items()},
        ),
    )


def _disc(values: Mapping[str, float]) -> Disc:
    return Disc(
        displacement=values.get("displacement", 0.0),
        tooth=int(values.get("tooth", 0)),
        run_out=values.get("run_out", 0.0),
        phase=values.get("phase", 0.0),
    )


def write_case(case: Case, folder: Path) -> tuple[Path, list[Path], list[Path]]:
    """Vehicle file, training runs and held-out runs of a case, all recorded into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    vehicle = folder / "vehicle.toml"
    vehicle.write_text(tomli_w.dumps(dict(case.vehicle)), encoding="utf-8")
    runs = [
        [write_run(folder / t.name, case.truth, case.faults, t, dict(case.vehicle)) for t in trials]
        for trials in (case.training, case.held_out)
    ]
    return vehicle, runs[0], runs[1]


def answer(case: Case) -> dict[str, Any]:
    """Ground truth of a case, as a tree."""
    return {
        "case": case.number,
        "category": case.category,
        "tyre": NAMES[case.truth.formula],
        "hidden": [{**asdict(h), "places": list(h.places)} for h in case.hidden],
        "careless": case.careless,
        "seconds": [t.excitation.seconds for t in (*case.training, *case.held_out)],
        "filters": {name: asdict(f) for name, f in case.truth.filters.items()},
        "machine": case.truth.machine._asdict(),
        "gears": list(case.truth.gears),
    }

"""The runs of a session in order, each with its own trial file."""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

from slipbench.bench.session.plan_file import PlannedTrial, SessionPlan
from slipbench.bench.vehicle.virtual_motorcycle import read_vehicle
from slipbench.protocol.configuration import load_toml, parse
from slipbench.protocol.errors import InputError
from slipbench.protocol.quantity import Quantity
from slipbench.protocol.shipped_files import file_or_shipped
from slipbench.protocol.trial_file import RPM, TrialFile

HIGHEST_SEED = 2**63 - 1


@dataclass(frozen=True)
class PlannedRun:
    """One run of a session.

    trial         name of the trial in the plan
    repeat, of    number of this run of the trial, counted from 1, and how many there are
    file          contents of its trial file
    """

    trial: str
    repeat: int
    of: int
    file: Mapping[str, Any]

    @property
    def name(self) -> str:
        """Name of the run and of its folder."""
        return f"{self.trial}-{self.repeat}"


def planned_runs(plan: SessionPlan, path: Path, folder: Path) -> tuple[PlannedRun, ...]:
    """Runs of a plan in their order. path: of the plan; folder: in which the trial files will lie.

    Raises InputError where a trial file is invalid or the plan does not suit it.
    """
    rows = [_runs_of(each, path, folder) for each in plan.trial]
    if plan.order == "fixed":
        return tuple(run for row in rows for run in row)
    return tuple(run for turn in zip_longest(*rows) for run in turn if run is not None)


def _runs_of(planned: PlannedTrial, path: Path, folder: Path) -> list[PlannedRun]:
    tree = _trial_tree(planned, path, folder)
    seed = int(tree.get("seed", 1))
    return [
        PlannedRun(
            planned.name,
            number,
            planned.repeats,
            {**tree, "seed": min(seed + number - 1, HIGHEST_SEED)},
        )
        for number in range(1, planned.repeats + 1)
    ]


def _trial_tree(planned: PlannedTrial, path: Path, folder: Path) -> dict[str, Any]:
    """The trial file with the changes of the plan; its paths lead from `folder`."""
    where = f"{path}: trial {planned.name!r}"
    base = file_or_shipped(planned.file, "trial", folder=path.parent)
    tree = load_toml(base)
    parse(tree, TrialFile, where=str(base))
    tree["name"] = planned.name
    _set_excitation(tree, planned)
    vehicle = file_or_shipped(tree["vehicle"], "vehicle", folder=base.parent).resolve()
    _set_operating_point(tree, planned, vehicle, where)
    tree["vehicle"] = os.path.relpath(vehicle, folder.resolve())
    if "controller" in tree:
        file = file_or_shipped(tree["controller"]["file"], "controller", folder=base.parent)
        tree["controller"] = {
            **tree["controller"],
            "file": os.path.relpath(file.resolve(), folder.resolve()),
        }
    parse(tree, TrialFile, where=where)
    return tree


def _set_excitation(tree: dict[str, Any], planned: PlannedTrial) -> None:
    if planned.excitation is not None:
        tree["excitation"] = {
            name: _as_written(getattr(planned.excitation, name))
            for name in type(planned.excitation).model_fields
            if name in planned.excitation.model_fields_set
        }
    changes = {"actuator": planned.actuator, "amplitude": planned.amplitude}
    tree["excitation"] |= {key: value for key, value in changes.items() if value is not None}


def _as_written(value: object) -> object:
    """A quantity as the text of the file; what has no unit unchanged."""
    return str(value) if isinstance(value, Quantity) else value


def _set_operating_point(
    tree: dict[str, Any], planned: PlannedTrial, vehicle: Path, where: str
) -> None:
    point = tree["operating_point"]
    if planned.gear is not None:
        point["gear"] = planned.gear
    window = planned.engine_speed
    if planned.speed is not None:
        per_speed = crank_speed_per_speed(vehicle, point["gear"], where)
        window = (planned.speed[0] * per_speed, planned.speed[1] * per_speed)
    if window is not None:
        low, high = (speed / RPM for speed in window)
        point["engine_speed"] = f"{(low + high) / 2:.6g} rpm"
        point["engine_speed_window"] = f"{_down((high - low) / 2)} rpm"


def crank_speed_per_speed(vehicle: Path, gear: int, where: str) -> float:
    """Crank speed per speed of the motorcycle in a gear without slip, rad/m.

    Raises InputError where the vehicle has no such gear.
    """
    motorcycle = read_vehicle(vehicle).motorcycle
    if not 1 <= gear <= len(motorcycle.gears):
        raise InputError(
            "the vehicle has no such gear",
            where=where,
            expected=f"1 to {len(motorcycle.gears)}",
            found=str(gear),
            remedy="change gear in the plan or in the trial file",
        )
    return float(motorcycle.gears[gear - 1] / motorcycle.rear_wheel.radius)


def _down(value: float) -> float:
    """The value with one decimal, not above it: a window must not grow by rounding."""
    return math.floor(value * 10 + 1e-6) / 10

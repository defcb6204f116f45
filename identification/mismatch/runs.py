"""The vehicle file and the run folders of an analysis, read and checked against each other."""

from collections.abc import Sequence
from pathlib import Path

from identification.mismatch.explain import Analysis, begin
from identification.mismatch.record import prepare
from plant.trouble import PlantError
from plant.vehicle_file import Vehicle, load_vehicle
from protocol.errors import InputError
from protocol.run_folder import read

RATIO = 1.15
"""Largest factor between the gear that the vehicle file tells and the one that the speeds show."""


def read_vehicle(path: Path) -> Vehicle:
    """Load a vehicle file; its faults are a user's mistake like any other."""
    try:
        return load_vehicle(path)
    except PlantError as fault:
        raise InputError(str(fault)) from fault


def open_analysis(
    vehicle_path: Path, training: Sequence[Path], held_out: Sequence[Path]
) -> Analysis:
    """Read everything. Raises InputError where it does not belong together."""
    both = {p.resolve() for p in training} & {p.resolve() for p in held_out}
    if both:
        raise InputError(
            "a held-out run is a training run as well, so it would prove nothing",
            where=", ".join(sorted(p.name for p in both)),
            remedy="hold out recordings that the analysis does not learn from",
        )
    vehicle = read_vehicle(vehicle_path)
    records = [[prepare(read(p), vehicle) for p in paths] for paths in (training, held_out)]
    analysis = begin(vehicle, *records)
    _check_same_vehicle(analysis)
    return analysis


def _check_same_vehicle(analysis: Analysis) -> None:
    """Refuse recordings whose speeds no gear of this vehicle can bring about."""
    others = analysis.held_out.records if analysis.held_out else ()
    for record in (*analysis.training.records, *others):
        if {"engine_speed", "rear"} <= set(record.measured):
            gear = int(record.inputs.gear[0])
            told = analysis.vehicle.motorcycle.gears[gear - 1]
            turning = record.measured["engine_speed"] / record.measured["rear"].clip(1.0)
            _check_ratio(record.name, gear, told, float(turning.mean()))


def _check_ratio(name: str, gear: int, told: float, shown: float) -> None:
    if not told / RATIO < shown < told * RATIO:
        raise InputError(
            "the recording is of another vehicle than the vehicle file",
            where=name,
            expected=f"{told:.3g} crank turns per wheel turn in gear {gear}",
            found=f"{shown:.3g}",
            remedy="give the vehicle file of this vehicle, or mend its gears",
        )

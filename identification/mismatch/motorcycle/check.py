"""Check that a recording can be of this vehicle."""

from slipbench.identification.mismatch.simulation.record import Record
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Inputs
from slipbench.protocol.errors import InputError

RATIO = 1.15
"""Largest factor between the gear ratio of the vehicle file and the ratio of the speeds."""


def check_same_vehicle(bike: Motorcycle, record: Record) -> None:
    """Raise InputError for a recording whose speeds do not fit the ratio of its gear."""
    if {"engine_speed", "rear"} <= set(record.measured):
        gear = int(Inputs(record.inputs).gear[0])
        ratio = record.measured["engine_speed"] / record.measured["rear"].clip(1.0)
        _check_ratio(record.name, gear, bike.gears[gear - 1], float(ratio.mean()))


def _check_ratio(name: str, gear: int, nominal: float, measured_ratio: float) -> None:
    if not nominal / RATIO < measured_ratio < nominal * RATIO:
        raise InputError(
            "the recording is of another vehicle than the vehicle file",
            where=name,
            expected=f"{nominal:.3g} crank turns per wheel turn in gear {gear}",
            found=f"{measured_ratio:.3g}",
            remedy="give the vehicle file of this vehicle, or correct its gear ratios",
        )

"""Whether a recording can be of this vehicle at all."""

from slipbench.identification.mismatch.simulation.record import Record
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Inputs
from slipbench.protocol.errors import InputError

RATIO = 1.15
"""Largest factor between the gear that the vehicle file tells and the one that the speeds show."""


def check_same_vehicle(bike: Motorcycle, record: Record) -> None:
    """Refuse a recording whose speeds no gear of this vehicle can bring about."""
    if {"engine_speed", "rear"} <= set(record.measured):
        gear = int(Inputs(record.inputs).gear[0])
        turning = record.measured["engine_speed"] / record.measured["rear"].clip(1.0)
        _check_ratio(record.name, gear, bike.gears[gear - 1], float(turning.mean()))


def _check_ratio(name: str, gear: int, told: float, shown: float) -> None:
    if not told / RATIO < shown < told * RATIO:
        raise InputError(
            "the recording is of another vehicle than the vehicle file",
            where=name,
            expected=f"{told:.3g} crank turns per wheel turn in gear {gear}",
            found=f"{shown:.3g}",
            remedy="give the vehicle file of this vehicle, or correct its gear ratios",
        )

"""What the vehicle file does not know exactly: parameters, gears in use, clocks of sensors."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from slipbench.identification.mismatch.simulation.coordinates import (
    CLOCK_OWNER,
    NORMAL_95,
    STATED_SHARE,
    Coordinate,
)
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Floats
from slipbench.plant.vehicle_file import Vehicle

EXACT = ("teeth", "resolution", "low_speed")
FORMS = {f"tyre.form_{i}": STATED_SHARE for i in range(1, 10)}
"""Departures from a formula, and how well (95 %) they are known if nobody tells."""
CLOCK = 0.3e-3  # s, standard deviation of what clocks may still differ by


def coordinates(vehicle: Vehicle, gears: Iterable[int], clocks: Iterable[str]) -> list[Coordinate]:
    """List what is uncertain: parameters of blocks, the gears in use, and sensors' clocks."""
    found = []
    for name, block in vehicle.motorcycle.blocks():
        for p in block.parameters():
            value = float(getattr(block, p.name))
            if p.name not in EXACT and (value > 0.0 or f"{name}.{p.name}" in FORMS):
                found.append(_coordinate(vehicle, name, p.name, value))
    ratios = vehicle.motorcycle.gears
    found += [_coordinate(vehicle, "gears", str(g), ratios[g - 1]) for g in sorted(set(gears))]
    return found + [Coordinate(CLOCK_OWNER, name, 0.0, CLOCK, True) for name in sorted(set(clocks))]


def _coordinate(vehicle: Vehicle, owner: str, name: str, value: float) -> Coordinate:
    key = f"{owner}.{name}"
    if key in FORMS:
        told = vehicle.plus_minus.get(key, FORMS[key])
        return Coordinate(owner, name, value, told / NORMAL_95, True)
    told = vehicle.plus_minus.get(key, STATED_SHARE * value)
    return Coordinate(owner, name, value, told / (NORMAL_95 * value))


def motorcycle_at(base: Motorcycle, known: Sequence[Coordinate], x: Floats) -> Motorcycle:
    """Return the motorcycle at coordinates x, every value kept inside its range."""
    changed: dict[str, dict[str, float]] = {}
    gears = list(base.gears)
    for coordinate, place in zip(known, x, strict=True):
        if coordinate.owner == "gears":
            gears[int(coordinate.name) - 1] = coordinate.at(float(place))
        elif not coordinate.of_clock:
            changed.setdefault(coordinate.owner, {})[coordinate.name] = coordinate.at(float(place))
    blocks = {}
    for owner, values in changed.items():
        block = getattr(base, owner)
        ranges = {p.name: (p.low, p.high) for p in block.parameters()}
        inside = {n: min(max(v, ranges[n][0]), ranges[n][1]) for n, v in values.items()}
        blocks[owner] = replace(block, **inside)
    return replace(base, gears=tuple(gears), **blocks)

"""Uncertain parameters of a vehicle file: of blocks, of gears in use, and of sensor clocks."""

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
"""Departures from the tyre formula, and their half widths (95 %) where the file states none."""
CLOCK = 0.3e-3  # s, prior standard deviation of clock offsets


def coordinates(vehicle: Vehicle, gears: Iterable[int], clocks: Iterable[str]) -> list[Coordinate]:
    """Return the uncertain parameters: of blocks, of the gears in use, and of sensor clocks."""
    uncertain = []
    for name, block in vehicle.motorcycle.blocks():
        for p in block.parameters():
            value = float(getattr(block, p.name))
            if p.name not in EXACT and (value > 0.0 or f"{name}.{p.name}" in FORMS):
                uncertain.append(_coordinate(vehicle, name, p.name, value))
    ratios = vehicle.motorcycle.gears
    uncertain += [_coordinate(vehicle, "gears", str(g), ratios[g - 1]) for g in sorted(set(gears))]
    return uncertain + [
        Coordinate(CLOCK_OWNER, name, 0.0, CLOCK, True) for name in sorted(set(clocks))
    ]


def _coordinate(vehicle: Vehicle, owner: str, name: str, value: float) -> Coordinate:
    key = f"{owner}.{name}"
    if key in FORMS:
        half_width = vehicle.plus_minus.get(key, FORMS[key])
        return Coordinate(owner, name, value, half_width / NORMAL_95, True)
    half_width = vehicle.plus_minus.get(key, STATED_SHARE * value)
    return Coordinate(owner, name, value, half_width / (NORMAL_95 * value))


def motorcycle_at(base: Motorcycle, known: Sequence[Coordinate], x: Floats) -> Motorcycle:
    """Return the motorcycle at coordinates x, (n,), every value limited to its range."""
    changed: dict[str, dict[str, float]] = {}
    gears = list(base.gears)
    for coordinate, position in zip(known, x, strict=True):
        if coordinate.owner == "gears":
            gears[int(coordinate.name) - 1] = coordinate.at(float(position))
        elif not coordinate.of_clock:
            changed.setdefault(coordinate.owner, {})[coordinate.name] = coordinate.at(
                float(position)
            )
    blocks = {}
    for owner, values in changed.items():
        block = getattr(base, owner)
        ranges = {p.name: (p.low, p.high) for p in block.parameters()}
        limited = {n: min(max(v, ranges[n][0]), ranges[n][1]) for n, v in values.items()}
        blocks[owner] = replace(block, **limited)
    return replace(base, gears=tuple(gears), **blocks)

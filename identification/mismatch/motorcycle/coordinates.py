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
    """Return the uncertain parameters: of blocks, of the gears in use, and of sensor clocks.

    Without a half width a value is good to 5 %, and a value of zero is exact, as is a half width of zero.
    """
    uncertain = []
    for owner, block in vehicle.motorcycle.blocks():
        for p in block.parameters():
            value, key = float(getattr(block, p.name)), f"{owner}.{p.name}"
            half_width = vehicle.plus_minus.get(key, FORMS.get(key, STATED_SHARE * value))
            if p.name not in EXACT and half_width > 0.0:
                uncertain.append(_coordinate(owner, p.name, value, half_width))
    for gear in sorted(set(gears)):
        ratio = vehicle.motorcycle.gears[gear - 1]
        half_width = vehicle.plus_minus.get(f"gears.{gear}", STATED_SHARE * ratio)
        if half_width > 0.0:
            uncertain.append(_coordinate("gears", str(gear), ratio, half_width))
    return uncertain + [
        Coordinate(CLOCK_OWNER, name, 0.0, CLOCK, True) for name in sorted(set(clocks))
    ]


def _coordinate(owner: str, name: str, value: float, half_width: float) -> Coordinate:
    """An error is a factor, unless the value is zero or may have either sign."""
    if f"{owner}.{name}" in FORMS or value == 0.0:
        return Coordinate(owner, name, value, half_width / NORMAL_95, True)
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

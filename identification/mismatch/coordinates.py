"""What the vehicle file does not know exactly, as numbers whose prior is the unit normal.

A parameter p with value p0 and half width d (95 %) is p0 exp(s x), s = d / (1.96 p0), x ~ N(0, 1):
positive numbers err by factors. Clocks of sensors agree up to a fraction of a millisecond.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from plant.motorcycle import Motorcycle
from plant.signals import Floats
from plant.vehicle_file import Vehicle

STATED_SHARE = 0.05
"""Half width (95 %) of a parameter of which the vehicle file tells none, as a share of it."""
EXACT = ("teeth", "resolution", "low_speed")
CLOCK = 0.3e-3  # s, standard deviation of what clocks may still differ by
NORMAL_95 = 1.959964


@dataclass(frozen=True)
class Coordinate:
    """owner: block, 'gears' or 'clock'; scale: of the logarithm, or s for a clock."""

    owner: str
    name: str
    value: float
    scale: float

    @property
    def key(self) -> str:
        """Name as in vehicle files."""
        return f"{self.owner}.{self.name}"

    def at(self, x: float) -> float:
        """Return the parameter's value at the coordinate x."""
        return self.scale * x if self.owner == "clock" else self.value * math.exp(self.scale * x)


def coordinates(vehicle: Vehicle, gears: Iterable[int], clocks: Iterable[str]) -> list[Coordinate]:
    """List what is uncertain: parameters of blocks, the gears in use, and sensors' clocks."""
    found = []
    for name, block in vehicle.motorcycle.blocks():
        for p in block.parameters():
            value = float(getattr(block, p.name))
            if p.name not in EXACT and value > 0.0:
                found.append(_coordinate(vehicle, name, p.name, value))
    ratios = vehicle.motorcycle.gears
    found += [_coordinate(vehicle, "gears", str(g), ratios[g - 1]) for g in sorted(set(gears))]
    return found + [Coordinate("clock", name, 0.0, CLOCK) for name in sorted(set(clocks))]


def _coordinate(vehicle: Vehicle, owner: str, name: str, value: float) -> Coordinate:
    told = vehicle.plus_minus.get(f"{owner}.{name}", STATED_SHARE * value)
    return Coordinate(owner, name, value, told / (NORMAL_95 * value))


def motorcycle_at(base: Motorcycle, known: list[Coordinate], x: Floats) -> Motorcycle:
    """Return the motorcycle at coordinates x, every value kept inside its range."""
    changed: dict[str, dict[str, float]] = {}
    gears = list(base.gears)
    for coordinate, place in zip(known, x, strict=True):
        if coordinate.owner == "gears":
            gears[int(coordinate.name) - 1] = coordinate.at(float(place))
        elif coordinate.owner != "clock":
            changed.setdefault(coordinate.owner, {})[coordinate.name] = coordinate.at(float(place))
    blocks = {}
    for owner, values in changed.items():
        block = getattr(base, owner)
        ranges = {p.name: (p.low, p.high) for p in block.parameters()}
        inside = {n: min(max(v, ranges[n][0]), ranges[n][1]) for n, v in values.items()}
        blocks[owner] = replace(block, **inside)
    return replace(base, gears=tuple(gears), **blocks)

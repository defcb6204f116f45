"""Motorcycles drawn within what a vehicle file states, with effects that its simulation lacks.

Each parameter that has a `plus_minus` is normal with that 95 % half width, cut off there. One or two
effects of the library are added, each from its smallest size of interest to one and a half times the
typical one. A motorcycle is given by seed and number, whatever was drawn before it.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from slipbench.plant.effects.effect import Effect
from slipbench.plant.effects.library import LIBRARY
from slipbench.plant.errors import PlantError
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.vehicle_file import Vehicle
from slipbench.protocol.errors import InputError

QUANTILE = 1.96  # standard deviations in a 95 % half width
LARGEST = 1.5  # of the typical size of an effect
OUTSIDE = "channel"  # effects that change only what is recorded: this loop has sensors of its own
GEARS = "gears"


@dataclass(frozen=True)
class DrawnMotorcycle:
    """motorcycle; number: with the seed it gives the same motorcycle again; effects: their keys."""

    motorcycle: Motorcycle
    number: int
    effects: tuple[str, ...]


def drawn_motorcycle(vehicle: Vehicle, seed: int, number: int) -> DrawnMotorcycle:
    """Motorcycle `number` of a seed. Raises InputError where the vehicle file states no deviation."""
    rng = np.random.default_rng((seed, number))
    motorcycle = within_deviations(vehicle, rng)
    added = _effects(motorcycle, rng)
    whole = replace(motorcycle, effects=(*motorcycle.effects, *added))
    return DrawnMotorcycle(whole, number, tuple(effect.key for effect in added))


def within_deviations(vehicle: Vehicle, rng: np.random.Generator) -> Motorcycle:
    """Motorcycle with its parameters drawn. Raises InputError where the file states no deviation."""
    if not vehicle.plus_minus:
        raise InputError(
            "this vehicle file does not state how well its numbers are known",
            where=vehicle.name,
            expected="plus_minus: the half width of what is reliable with 95 %",
            found="none",
            remedy='for example mass = { value = 245, unit = "kg", plus_minus = 5 }',
        )
    motorcycle = vehicle.motorcycle
    for key in sorted(vehicle.plus_minus):
        motorcycle = _varied(motorcycle, key, vehicle.plus_minus[key] * _normal(rng) / QUANTILE)
    return motorcycle


def _normal(rng: np.random.Generator) -> float:
    """Standard normal, drawn again outside the half width."""
    while True:
        value = float(rng.standard_normal())
        if abs(value) <= QUANTILE:
            return value


def _varied(motorcycle: Motorcycle, key: str, by: float) -> Motorcycle:
    """Motorcycle with one parameter changed, inside its valid range."""
    owner, _, name = key.partition(".")
    if owner == GEARS:
        gears = list(motorcycle.gears)
        gears[int(name) - 1] += by
        return replace(motorcycle, gears=tuple(gears))
    block = getattr(motorcycle, owner, None)
    known = {p.name: p for p in block.parameters()} if block is not None else {}
    if block is None or name not in known:
        return motorcycle  # a parameter of an effect keeps its value
    value = min(max(getattr(block, name) + by, known[name].low), known[name].high)
    changes: dict[str, Any] = {owner: replace(block, **{name: value})}
    return replace(motorcycle, **changes)


def _effects(motorcycle: Motorcycle, rng: np.random.Generator) -> list[Effect]:
    """One or two effects that the motorcycle does not have yet."""
    has = {effect.key for effect in motorcycle.effects}
    found: list[Effect] = []
    kinds = [kind for kind in LIBRARY if kind.block != OUTSIDE]
    count = int(rng.integers(1, 3))
    while len(found) < count:
        candidates = kinds[int(rng.integers(len(kinds)))].candidates()
        effect = _sized(candidates[int(rng.integers(len(candidates)))], float(rng.uniform()))
        if effect is not None and effect.key not in has:
            has.add(effect.key)
            found.append(effect)
    return found


def _sized(effect: Effect, share: float) -> Effect | None:
    """Effect at a share of the way from its smallest to its largest size; None where not valid."""
    sizes = {}
    for p in effect.parameters():
        if p.smallest is not None:
            largest = p.absent + LARGEST * (p.typical - p.absent)
            if p.absent > p.typical:  # a limit: the smaller, the stronger
                largest = p.typical / LARGEST
            sizes[p.name] = min(max(p.smallest + share * (largest - p.smallest), p.low), p.high)
    try:
        return replace(effect, **sizes)
    except PlantError:
        return None

"""Stops of the states of a model file: a state that cannot go beyond a limit.

A position that meets its stop bounces: its speed, the state that is its rate, comes back times the
restitution. A state without such a speed, as a level, stays at the limit until its rate leads back.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.model_file import ModelFile, Number, State
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import InputError

Limit = str | float
"""A parameter, or a number in SI."""


@dataclass(frozen=True)
class Stop:
    """state: its name; speed: the state that is its rate, empty: none; the rest: see `State`."""

    state: str
    speed: str
    low: Limit
    high: Limit
    restitution: Limit

    def at(self, known: Mapping[str, float]) -> tuple[float, float, float]:
        """Return low, high and restitution, SI. known: parameters."""
        low, high, back = (
            known[told] if isinstance(told, str) else told
            for told in (self.low, self.high, self.restitution)
        )
        return low, high, back


def read_stops(file: ModelFile, where: str) -> tuple[Stop, ...]:
    """Return the stops of a model file. Raises InputError for one that cannot be."""
    known = {name: number.si for name, number in file.parameters.items()}
    stops = []
    for name, state in file.states.items():
        speed = state.rate.strip() if state.rate.strip() in file.states else ""
        stop = Stop(
            name,
            speed,
            _limit(state.low, -math.inf),
            _limit(state.high, math.inf),
            state.restitution,
        )
        _check(stop, state, known, f"{where}: states.{name}")
        if state.low is not None or state.high is not None:
            stops.append(stop)
    return tuple(stops)


def _limit(told: str | Number | None, none: float) -> Limit:
    if told is None:
        return none
    return told if isinstance(told, str) else told.si


def _check(stop: Stop, state: State, known: Mapping[str, float], where: str) -> None:
    low, high, back = stop.at(known)
    if state.restitution != 0.0 and not stop.speed:
        raise InputError(
            "a restitution needs a speed that comes back",
            where=f"{where}.restitution",
            expected="a rate that is the name of a state, as in rate = 'speed'",
            found=f"rate = {state.rate!r}",
            remedy="make the speed a state, or remove the restitution: the state stays at its limit",
        )
    if state.restitution != 0.0 and state.low is None and state.high is None:
        raise InputError(
            "a restitution without a stop",
            where=f"{where}.restitution",
            remedy="give low or high, or remove the restitution",
        )
    if not low < high:
        raise InputError(
            "the stops are in the wrong order",
            where=where,
            expected="low below high",
            found=f"low {low:g}, high {high:g} in base units",
        )
    if not 0.0 <= back <= 1.0:
        raise InputError(
            "a restitution is a share of the speed",
            where=f"{where}.restitution",
            expected="0 to 1",
            found=f"{back:g}",
        )
    if isinstance(state.start, Number) and not low <= state.start.si <= high:
        raise InputError(
            "the state starts beyond its stop",
            where=f"{where}.start",
            expected=f"{low:g} to {high:g} in base units",
            found=f"{state.start.si:g}",
        )


def within_restitution(stops: Iterable[Stop], names: Sequence[str], values: Floats) -> Floats:
    """Return the parameters with restitutions from 0 to 1."""
    kept = values.copy()
    for stop in stops:
        if isinstance(stop.restitution, str):
            k = names.index(stop.restitution)
            kept[k] = min(max(kept[k], 0.0), 1.0)
    return kept


def check_order(stops: Iterable[Stop], names: Sequence[str], values: Floats) -> None:
    """Raise PlantError where a lower stop is not below the upper one."""
    known = dict(zip(names, map(float, values), strict=True))
    for stop in stops:
        low, high, _ = stop.at(known)
        if not low < high:
            raise PlantError(
                "the stops are in the wrong order",
                stop.state,
                "low below high",
                f"low {low:g}, high {high:g} in base units",
                "correct the limits",
            )

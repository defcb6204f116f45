"""Stops of the states of a model file: limits that a state cannot exceed.

A position bounces at its stop: its speed, the state that is its rate, is reversed and multiplied
by the restitution. A state without a speed, such as a level, stays at the limit until its rate
reverses.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.model_file import ModelFile, Number, State
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import InputError

Limit = str | float
"""Name of a parameter, or a number, SI."""


@dataclass(frozen=True)
class Stop:
    """Stops of one state. speed: the state that is its rate, empty: none; others: see `State`."""

    state: str
    speed: str
    low: Limit
    high: Limit
    restitution: Limit

    def at(self, known: Mapping[str, float]) -> tuple[float, float, float]:
        """Return low, high and restitution, SI. known: parameters."""
        low, high, back = (
            known[limit] if isinstance(limit, str) else limit
            for limit in (self.low, self.high, self.restitution)
        )
        return low, high, back


def read_stops(file: ModelFile, where: str) -> tuple[Stop, ...]:
    """Return the stops of a model file. Raises InputError for an invalid one."""
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


def _limit(stated: str | Number | None, default: float) -> Limit:
    if stated is None:
        return default
    return stated if isinstance(stated, str) else stated.si


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
    """Return the parameters, SI, (parameters,), with restitutions limited to 0 to 1."""
    limited = values.copy()
    for stop in stops:
        if isinstance(stop.restitution, str):
            k = names.index(stop.restitution)
            limited[k] = min(max(limited[k], 0.0), 1.0)
    return limited


def check_order(stops: Iterable[Stop], names: Sequence[str], values: Floats) -> None:
    """Raise PlantError where a lower stop is not below the upper one. values: SI, (parameters,)."""
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

"""Free curves of a model file: what acts at a place along a quantity, and has no name.

A broken line f(z) over knots of z, level beyond them, is added to an input, a seam, the rate of a
state or an output, before the effects there. z is the time, an input, a state, a seam, or the rate
of an input or a state, as the simulation has it; what the curve does acts back on it. A periodic
curve repeats every turn of z, an angle; it is the periodic cubic spline through its knots (de Boor, "A
Practical Guide to Splines" (2001)), since what turns has few corners.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from scipy.interpolate import CubicSpline

from slipbench.identification.mismatch.simulation.coordinates import NORMAL_95, Coordinate
from slipbench.identification.mismatch.systems.equations import Equations, rate_name
from slipbench.identification.mismatch.systems.kernel import ONE_TURN, OWN, first_input
from slipbench.identification.mismatch.systems.model_file import CurveTable, ModelFile
from slipbench.identification.mismatch.systems.placing import places, unseen_angle
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import nearest
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import InputError
from slipbench.protocol.units import linear, to_base

TIME = "time"
RATE = "_rate"
FINER, FINEST = 4, 96
"""Pieces of a broken line between two knots of a periodic curve, and at least around a turn."""


@dataclass(frozen=True)
class TableCurve(Effect):
    """A broken line at a place.

    knots: of `along`, increasing; heights: of the place; both SI. repeats: every turn, and smooth.
    """

    name = "curve"
    block = ""
    shows_in = ()
    confused_with = ()

    place: str
    along: str
    knots: tuple[float, ...]
    heights: tuple[float, ...]
    repeats: bool = False

    @property
    def subject(self) -> str:
        """Return its place and its quantity."""
        return f"{self.place}/{self.along}"

    @property
    def owner(self) -> str:
        """Return what the keys of its values begin with."""
        return f"curves.{self.place}.{'turn_of_' if self.repeats else ''}{self.along}"

    @property
    def table(self) -> tuple[Floats, Floats]:
        """Return knots and heights of a broken line; of a periodic curve close together over a turn."""
        knots, heights = np.array(self.knots), np.array(self.heights)
        if not self.repeats:
            return knots, heights
        knots = np.mod(knots, ONE_TURN)
        order = np.argsort(knots)
        around = np.append(knots[order], knots[order[0]] + ONE_TURN)
        smooth = CubicSpline(
            around, np.append(heights[order], heights[order[0]]), bc_type="periodic"
        )
        fine = np.linspace(0.0, ONE_TURN, max(FINEST, FINER * order.size) + 1)
        return fine, smooth(fine)

    def silent(self) -> Self:
        """Return it with all values zero."""
        return replace(self, heights=(0.0,) * len(self.heights))

    def with_height(self, number: int, height: float) -> Self:
        """Return it with another value at one knot."""
        heights = (*self.heights[:number], height, *self.heights[number + 1 :])
        return replace(self, heights=heights)

    def coordinates(self, known: Mapping[str, float]) -> Iterable[Coordinate]:
        """Yield its values that are not exact. known: 95 % half widths by key."""
        for k, height in enumerate(self.heights):
            half = known[f"{self.owner}.{k}"]
            if half > 0.0:
                yield Coordinate(self.owner, str(k), height, half / NORMAL_95, linear=True)


@dataclass(frozen=True)
class UnseenAngleCurve(TableCurve):
    """A curve along an angle of which recordings tell only the speed."""

    unseen_turn = True


def curve_along(file: ModelFile, *told: Any) -> TableCurve:
    """Return a curve of a file. told: what `TableCurve` is made of, place and quantity first."""
    return (UnseenAngleCurve if told[1] == unseen_angle(file) else TableCurve)(*told)


def read_curve(told: CurveTable, e: Equations, file: ModelFile, where: str) -> TableCurve:
    """Return a curve of a model file. Raises InputError where it cannot act so."""
    units = {p.name: p.unit for p in places(file)}
    if told.at not in units:
        raise InputError(
            f"no place {told.at!r}",
            where=f"{where}.at",
            expected=", ".join(units),
            remedy=nearest(told.at, units),
        )
    quantities = known_quantities(told.at, e, file)
    if told.along not in quantities:
        raise InputError(
            f"a curve at {told.at!r} cannot act along {told.along!r}",
            where=f"{where}.along",
            expected=", ".join(quantities),
            remedy=nearest(told.along, quantities),
        )
    try:
        slope, offset = linear(told.along_unit, unit_of(told.along, file))
        height, _ = linear(told.unit, units[told.at])
    except ValueError as fault:
        raise InputError(str(fault), where=where, remedy="correct the unit") from fault
    knots = tuple(slope * z + offset for z in told.knots)
    if told.periodic:
        _check_turn(told, knots, unit_of(told.along, file), where)
    values = tuple(height * f for f in told.values)
    return curve_along(file, told.at, told.along, knots, values, told.periodic)


def _check_turn(told: CurveTable, knots: tuple[float, ...], unit: str, where: str) -> None:
    """Raise InputError where a curve cannot repeat every turn."""
    if unit != "rad":
        raise InputError(
            f"a curve along {told.along!r} does not repeat every turn",
            where=f"{where}.periodic",
            expected="an angle, in rad or deg",
            found=f"a quantity in {unit}",
            remedy="take periodic away, or let the curve act along an angle",
        )
    if knots[-1] - knots[0] >= ONE_TURN:
        raise InputError(
            "the knots of a periodic curve span more than a turn",
            where=f"{where}.knots",
            expected="less than a turn from the first to the last",
            found=f"{knots[-1] - knots[0]:.4g} rad",
            remedy="leave out the knots that repeat",
        )


def known_quantities(at: str, e: Equations, file: ModelFile) -> dict[str, int]:
    """Return the quantities along which a curve at a place may act, and their kernel numbers.

    A seam or the rate of a state is known to the places after it only. An output that shows a
    quantity as it is stands for it.
    """
    here, first, inputs = e.places.index(at), first_input(e), len(e.inputs)
    before = range(inputs, min(here, inputs + len(e.seams) + len(e.states)))
    found = {TIME: 0}
    found |= {name: first + k for k, name in enumerate((*e.inputs, *e.states))}
    found |= {f"{name}{RATE}": 1 + k for k, name in enumerate(e.inputs)}
    found |= {e.places[p]: 1 + p for p in before}
    for name, state in file.states.items():
        if state.rate.strip() in e.states:
            found[rate_name(name)] = found[state.rate.strip()]
    found[at] = OWN
    for name, output in file.outputs.items():
        for end in ("", RATE):
            if f"{output.value.strip()}{end}" in found:
                found.setdefault(f"{name}{end}", found[f"{output.value.strip()}{end}"])
    return found


def curve_in_kernel(at: str, regressor: str, e: Equations, file: ModelFile) -> str | None:
    """Return the quantity of a regressor as a curve of a model file has it; None: it cannot."""
    along = regressor.replace(" ", "_")
    return along if along in known_quantities(at, e, file) else None


def unit_of(along: str, file: ModelFile) -> str:
    """Return the SI unit of a quantity along which a curve acts."""
    if along == TIME:
        return "s"
    sizes = {
        n: t.size
        for p in (file.inputs, file.states, file.seams, file.outputs)
        for n, t in p.items()
    }
    if along in sizes:
        return sizes[along].si_unit
    unit = sizes[along.removesuffix(RATE)].si_unit
    return "1/s" if unit == "1" else f"{unit}/s"


def half_widths(told: CurveTable, curve: TableCurve) -> dict[str, float]:
    """95 % half widths of a curve's values by key, SI."""
    slope = to_base(told.unit)[0]
    return {f"{curve.owner}.{k}": slope * half for k, half in enumerate(told.half_widths)}

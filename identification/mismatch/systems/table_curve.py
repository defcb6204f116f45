"""Free curves of a model file (in-model splines): a function of a regressor added at a place.

A piecewise linear function f(z) over knots of z, constant beyond them, is added to an input, a
seam, the rate of a state or an output, before the effects there. z is the time, an input, a state,
a seam, or the rate of an input or a state, as simulated; the curve feeds back on z. A periodic
curve repeats every turn of z, an angle; it is the periodic cubic spline through its knots (de
Boor, "A Practical Guide to Splines" (2001)), since functions of a rotation angle are mostly
smooth.
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
"""Linear pieces between two knots of a periodic curve, and their least number per turn."""


@dataclass(frozen=True)
class TableCurve(Effect):
    """A piecewise linear function at a place.

    knots: of `along`, increasing; heights: values, SI. repeats: periodic every turn, and smooth.
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
        """Return the place and the regressor."""
        return f"{self.place}/{self.along}"

    @property
    def owner(self) -> str:
        """Return the prefix of the keys of its values."""
        return f"curves.{self.place}.{'turn_of_' if self.repeats else ''}{self.along}"

    @property
    def table(self) -> tuple[Floats, Floats]:
        """Return knots and heights, (n,) each; of a periodic curve on a fine grid over a turn."""
        knots, heights = np.array(self.knots), np.array(self.heights)
        if not self.repeats:
            return knots, heights
        knots = np.mod(knots, ONE_TURN)
        order = np.argsort(knots)
        periodic_knots = np.append(knots[order], knots[order[0]] + ONE_TURN)
        smooth = CubicSpline(
            periodic_knots, np.append(heights[order], heights[order[0]]), bc_type="periodic"
        )
        fine = np.linspace(0.0, ONE_TURN, max(FINEST, FINER * order.size) + 1)
        return fine, smooth(fine)

    def silent(self) -> Self:
        """Return the curve with all values zero."""
        return replace(self, heights=(0.0,) * len(self.heights))

    def with_height(self, number: int, height: float) -> Self:
        """Return the curve with another value at one knot."""
        heights = (*self.heights[:number], height, *self.heights[number + 1 :])
        return replace(self, heights=heights)

    def coordinates(self, known: Mapping[str, float]) -> Iterable[Coordinate]:
        """Yield the values that are not exact. known: 95 % half widths by key."""
        for k, height in enumerate(self.heights):
            half = known[f"{self.owner}.{k}"]
            if half > 0.0:
                yield Coordinate(self.owner, str(k), height, half / NORMAL_95, linear=True)


@dataclass(frozen=True)
class UnseenAngleCurve(TableCurve):
    """A curve over an unmeasured angle, of which only the speed is recorded."""

    unseen_turn = True


def curve_along(file: ModelFile, *fields: Any) -> TableCurve:
    """Return a curve of a file. fields: those of `TableCurve`, place and regressor first."""
    return (UnseenAngleCurve if fields[1] == unseen_angle(file) else TableCurve)(*fields)


def read_curve(entry: CurveTable, e: Equations, file: ModelFile, where: str) -> TableCurve:
    """Return a curve of a model file. Raises InputError for an invalid one."""
    units = {p.name: p.unit for p in places(file)}
    if entry.at not in units:
        raise InputError(
            f"no place {entry.at!r}",
            where=f"{where}.at",
            expected=", ".join(units),
            remedy=nearest(entry.at, units),
        )
    quantities = known_quantities(entry.at, e, file)
    if entry.along not in quantities:
        raise InputError(
            f"a curve at {entry.at!r} cannot act along {entry.along!r}",
            where=f"{where}.along",
            expected=", ".join(quantities),
            remedy=nearest(entry.along, quantities),
        )
    try:
        slope, offset = linear(entry.along_unit, unit_of(entry.along, file))
        height, _ = linear(entry.unit, units[entry.at])
    except ValueError as fault:
        raise InputError(str(fault), where=where, remedy="correct the unit") from fault
    knots = tuple(slope * z + offset for z in entry.knots)
    if entry.periodic:
        _check_turn(entry, knots, unit_of(entry.along, file), where)
    values = tuple(height * f for f in entry.values)
    return curve_along(file, entry.at, entry.along, knots, values, entry.periodic)


def _check_turn(entry: CurveTable, knots: tuple[float, ...], unit: str, where: str) -> None:
    """Raise InputError where a curve cannot be periodic."""
    if unit != "rad":
        raise InputError(
            f"a curve along {entry.along!r} does not repeat every turn",
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
    """Return the regressors that a curve at a place may have, with their indices in the kernel.

    A seam or the rate of a state is available to later places only. An output whose equation is the
    name of a quantity is an alias of it.
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


def unit_of(along: str, file: ModelFile) -> str:
    """Return the SI unit of the regressor of a curve."""
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


def half_widths(entry: CurveTable, curve: TableCurve) -> dict[str, float]:
    """Return the 95 % half widths of a curve's values by key, SI."""
    slope = to_base(entry.unit)[0]
    return {f"{curve.owner}.{k}": slope * half for k, half in enumerate(entry.half_widths)}

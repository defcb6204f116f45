"""Write a model file with new numbers and the effects that were found."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from slipbench.identification.mismatch.simulation.written_units import WrittenUnits
from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.identification.mismatch.systems.kernel import ONE_TURN
from slipbench.identification.mismatch.systems.model_file import ModelFile
from slipbench.identification.mismatch.systems.placing import places
from slipbench.identification.mismatch.systems.table_curve import TableCurve, unit_of
from slipbench.identification.mismatch.systems.vectors.element import element_names
from slipbench.identification.mismatch.systems.vectors.writing import (
    vector_parameters,
    with_vectors,
)
from slipbench.plant.signals import Floats
from slipbench.plant.toml_text import DIGITS, DIGITS_OF_HALF_WIDTH, edited, rounded
from slipbench.protocol.units import linear


def as_text(
    source: str,
    file: ModelFile,
    values: Floats,
    effects: Sequence[SeamEffect],
    known: Mapping[str, float],
    written: WrittenUnits,
    curves: Sequence[Mapping[str, Any]] = (),
) -> str:
    """Return the text of a model file with new parameters, effects and free curves.

    source: text as it was; its comments, order and units stay. values: of the parameters, SI;
    known: 95 % half widths, SI. New effects are written in the units of the file. curves: tables.
    """
    wanted: dict[str, Any] = {"name": file.name, "description": file.description}
    numbers = {
        name: _parameter(float(value), number.si_unit, known[f"parameters.{name}"])
        for (name, number), value in zip(file.parameters.items(), values, strict=True)
    }
    of_vectors = {
        e for n, s in vector_parameters(source).items() for e in element_names(n, s).values()
    }
    wanted["parameters"] = {n: told for n, told in numbers.items() if n not in of_vectors}
    there = {(e.name, e.at) for e in file.effects}
    wanted["effects"] = [
        _effect(e, known, written, new=(e.name, e.place.name) not in there) for e in effects
    ]
    wanted["curves"] = list(curves)
    source = with_vectors(source, numbers) if of_vectors else source
    return edited(source, {key: value for key, value in wanted.items() if value}, linear)


def curves_as_tables(
    curves: Sequence[TableCurve], file: ModelFile, known: Mapping[str, float], written: WrittenUnits
) -> Iterator[dict[str, Any]]:
    """Yield the tables of curves: in the units of the table that is there, else of the file."""
    there = {(c.at, c.along, c.periodic): c for c in file.curves}
    units = {p.name: p.unit for p in places(file)}
    for own in dict.fromkeys(map(_own, curves)):
        curve, halves = _sum([c for c in curves if _own(c) == own], known)
        along, height = unit_of(curve.along, file), units[curve.place]
        if own in there:
            of_knots, of_values = there[own].along_unit, there[own].unit
        else:
            words = (curve.along.replace("_", " "), curve.place.replace("_", " "))
            of_knots, of_values = (
                written.factor(along, words[0])[1],
                written.factor(height, words[1])[1],
            )
        slope, offset = linear(along, of_knots)
        factor, _ = linear(height, of_values)
        yield {
            "at": curve.place,
            "along": curve.along,
            "knots": _row(slope * z + offset for z in curve.knots),
            "along_unit": of_knots,
            "values": _row(factor * f for f in curve.heights),
            "unit": of_values,
            "plus_minus": _row((factor * h for h in halves), DIGITS_OF_HALF_WIDTH),
            **({"periodic": True} if curve.repeats else {}),
        }


def _own(curve: TableCurve) -> tuple[str, str, bool]:
    """What tells a curve from others of the file."""
    return curve.place, curve.along, curve.repeats


def _sum(curves: Sequence[TableCurve], known: Mapping[str, float]) -> tuple[TableCurve, Floats]:
    """Return the sum of curves at one place along one quantity, and its values' half widths.

    A sum of broken lines is one over the knots of all. Half widths are those of independent values.
    """
    knots = np.unique(np.concatenate([c.knots for c in curves]))
    height, square = np.zeros(knots.size), np.zeros(knots.size)
    for c in curves:
        own = [known.get(f"{c.owner}.{k}", 0.0) for k in range(len(c.knots))]
        turn = ONE_TURN if c.repeats else None
        height += np.interp(knots, *c.table, period=turn)
        square += np.interp(knots, c.knots, own, period=turn) ** 2
    return replace(curves[0], knots=tuple(knots), heights=tuple(height)), np.sqrt(square)


def _row(values: Iterable[float], digits: int = DIGITS) -> list[float]:
    return [rounded(float(v), digits) for v in values]


def _parameter(value: float, unit: str, half: float) -> dict[str, Any]:
    return {"value": value, "unit": unit, "plus_minus": half}


def _effect(
    effect: SeamEffect, known: Mapping[str, float], written: WrittenUnits, new: bool
) -> dict[str, Any]:
    place = effect.place
    entry: dict[str, Any] = {"name": effect.name, "at": place.name}
    if place.other:
        entry["using"] = place.other
    names = [name.replace("_", " ") for name in (place.name, place.other) if name]
    values = {}
    for p in effect.parameters():
        factor, unit = written.factor(p.unit, *names) if new else (1.0, p.unit)
        number: dict[str, Any] = {"value": factor * float(getattr(effect, p.name)), "unit": unit}
        if (half := known.get(f"effects.{effect.key}.{p.name}")) is not None:
            number["plus_minus"] = factor * half
        values[p.name] = number
    return {**entry, "values": values}

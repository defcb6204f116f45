"""Write a model file with new parameter values and the detected effects."""

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

    source: original text; its comments, order and units are kept. values: of the parameters, SI,
    (parameters,); known: 95 % half widths, SI. New effects get the units of the file. curves:
    tables.
    """
    changes: dict[str, Any] = {"name": file.name, "description": file.description}
    numbers = {
        name: _parameter(float(value), number.si_unit, known[f"parameters.{name}"])
        for (name, number), value in zip(file.parameters.items(), values, strict=True)
    }
    elements_of_vectors = {
        e for n, s in vector_parameters(source).items() for e in element_names(n, s).values()
    }
    changes["parameters"] = {
        n: number for n, number in numbers.items() if n not in elements_of_vectors
    }
    existing = {(e.name, e.at) for e in file.effects}
    changes["effects"] = [
        _effect(e, known, written, new=(e.name, e.place.name) not in existing) for e in effects
    ]
    changes["curves"] = list(curves)
    source = with_vectors(source, numbers) if elements_of_vectors else source
    return edited(source, {key: value for key, value in changes.items() if value}, linear)


def curves_as_tables(
    curves: Sequence[TableCurve], file: ModelFile, known: Mapping[str, float], written: WrittenUnits
) -> Iterator[dict[str, Any]]:
    """Yield the tables of curves, in the units of an existing table, else of the file."""
    existing = {(c.at, c.along, c.periodic): c for c in file.curves}
    units = {p.name: p.unit for p in places(file)}
    for identity in dict.fromkeys(map(_identity, curves)):
        curve, halves = _sum([c for c in curves if _identity(c) == identity], known)
        along, height = unit_of(curve.along, file), units[curve.place]
        if identity in existing:
            knot_unit, value_unit = existing[identity].along_unit, existing[identity].unit
        else:
            names = (curve.along.replace("_", " "), curve.place.replace("_", " "))
            knot_unit, value_unit = (
                written.factor(along, names[0])[1],
                written.factor(height, names[1])[1],
            )
        slope, offset = linear(along, knot_unit)
        factor, _ = linear(height, value_unit)
        yield {
            "at": curve.place,
            "along": curve.along,
            "knots": _row(slope * z + offset for z in curve.knots),
            "along_unit": knot_unit,
            "values": _row(factor * f for f in curve.heights),
            "unit": value_unit,
            "plus_minus": _row((factor * h for h in halves), DIGITS_OF_HALF_WIDTH),
            **({"periodic": True} if curve.repeats else {}),
        }


def _identity(curve: TableCurve) -> tuple[str, str, bool]:
    """Return the identity of a curve among those of the file."""
    return curve.place, curve.along, curve.repeats


def _sum(curves: Sequence[TableCurve], known: Mapping[str, float]) -> tuple[TableCurve, Floats]:
    """Return the sum of curves at one place along one quantity, and its values' half widths.

    A sum of piecewise linear functions is one over all knots. Half widths are of independent
    values.
    """
    knots = np.unique(np.concatenate([c.knots for c in curves]))
    height, square = np.zeros(knots.size), np.zeros(knots.size)
    for c in curves:
        halves = [known.get(f"{c.owner}.{k}", 0.0) for k in range(len(c.knots))]
        turn = ONE_TURN if c.repeats else None
        height += np.interp(knots, *c.table, period=turn)
        square += np.interp(knots, c.knots, halves, period=turn) ** 2
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

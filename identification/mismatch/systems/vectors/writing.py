"""Write the elements of vectors and matrices back into the lists of a model file."""

from collections.abc import Mapping
from typing import Any

import tomlkit

from slipbench.identification.mismatch.systems.vectors.element import Shape, element_names
from slipbench.identification.mismatch.systems.vectors.shapes import list_shape
from slipbench.plant.toml_text import DIGITS, DIGITS_OF_HALF_WIDTH, rounded
from slipbench.protocol.units import linear

SAME = 1e-12
"""Relative difference of two numbers that is rounding of a conversion."""


def vector_parameters(source: str) -> dict[str, Shape]:
    """Return the shapes of the parameters of a model file that are vectors or matrices."""
    told = tomlkit.parse(source).unwrap().get("parameters", {})
    shapes = {name: list_shape(entry.get("value"), name) for name, entry in told.items()}
    return {name: shape for name, shape in shapes.items() if shape}


def with_vectors(source: str, numbers: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the text of a model file with other numbers in its vectors, all else as written.

    numbers: value, unit and plus_minus of each element by its name. Half widths become a list where
    they differ.
    """
    document = tomlkit.parse(source)
    for name, shape in vector_parameters(source).items():
        entry: Any = document["parameters"][name]
        told = {index: numbers[element] for index, element in element_names(name, shape).items()}
        slope, offset = linear(entry.get("unit", "1"), next(iter(told.values()))["unit"])
        values = {index: (n["value"] - offset) / slope for index, n in told.items()}
        _set(entry, "value", shape, values, DIGITS)
        halves = {index: n["plus_minus"] / slope for index, n in told.items()}
        _set(entry, "plus_minus", shape, halves, DIGITS_OF_HALF_WIDTH)
    return tomlkit.dumps(document)


def _set(
    entry: Any, key: str, shape: Shape, wanted: Mapping[tuple[int, ...], float], digits: int
) -> None:
    """Set the numbers of a list that are not there already; a single number becomes a list."""
    written = entry.get(key)
    now = {i: _at(written, i) if isinstance(written, list) else written for i in wanted}
    changed = {i: w for i, w in wanted.items() if now[i] is None or abs(w - now[i]) > SAME * abs(w)}
    if changed and not isinstance(written, list):
        entry[key] = _nested(shape, {i: rounded(w, digits) for i, w in wanted.items()})
        return
    for index, value in changed.items():
        _at(written, index[:-1])[index[-1]] = rounded(value, digits)


def _at(told: Any, index: tuple[int, ...]) -> Any:
    for k in index:
        told = told[k]
    return told


def _nested(shape: Shape, told: Mapping[tuple[int, ...], float], at: tuple[int, ...] = ()) -> Any:
    """Return lists of a shape with these numbers."""
    if not shape:
        return told[at]
    return [_nested(shape[1:], told, (*at, k)) for k in range(shape[0])]

"""Write elements of vectors and matrices into the lists of a model file."""

from collections.abc import Mapping
from typing import Any

import tomlkit

from slipbench.identification.mismatch.systems.vectors.element import Shape, element_names
from slipbench.identification.mismatch.systems.vectors.shapes import list_shape
from slipbench.plant.toml_text import DIGITS, DIGITS_OF_HALF_WIDTH, rounded
from slipbench.protocol.units import linear

SAME = 1e-12
"""Relative difference of two numbers up to which it is due to rounding in a conversion."""


def vector_parameters(source: str) -> dict[str, Shape]:
    """Return the shapes of the parameters of a model file that are vectors or matrices."""
    parameters = tomlkit.parse(source).unwrap().get("parameters", {})
    shapes = {name: list_shape(entry.get("value"), name) for name, entry in parameters.items()}
    return {name: shape for name, shape in shapes.items() if shape}


def with_vectors(source: str, numbers: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the text of a model file with new numbers in its vectors, otherwise unchanged.

    numbers: value, unit and plus_minus of each element by its name. Half widths become a list where
    they differ.
    """
    document = tomlkit.parse(source)
    for name, shape in vector_parameters(source).items():
        entry: Any = document["parameters"][name]
        numbers_by_index = {
            index: numbers[element] for index, element in element_names(name, shape).items()
        }
        slope, offset = linear(
            entry.get("unit", "1"), next(iter(numbers_by_index.values()))["unit"]
        )
        values = {index: (n["value"] - offset) / slope for index, n in numbers_by_index.items()}
        _set(entry, "value", shape, values, DIGITS)
        halves = {index: n["plus_minus"] / slope for index, n in numbers_by_index.items()}
        _set(entry, "plus_minus", shape, halves, DIGITS_OF_HALF_WIDTH)
    return tomlkit.dumps(document)


def _set(
    entry: Any, key: str, shape: Shape, new: Mapping[tuple[int, ...], float], digits: int
) -> None:
    """Set the numbers of a list that have changed; a single number becomes a list."""
    written = entry.get(key)
    present = {i: _at(written, i) if isinstance(written, list) else written for i in new}
    changed = {
        i: value
        for i, value in new.items()
        if present[i] is None or abs(value - present[i]) > SAME * abs(value)
    }
    if changed and not isinstance(written, list):
        entry[key] = _nested(shape, {i: rounded(value, digits) for i, value in new.items()})
        return
    for index, value in changed.items():
        _at(written, index[:-1])[index[-1]] = rounded(value, digits)


def _at(value: Any, index: tuple[int, ...]) -> Any:
    for k in index:
        value = value[k]
    return value


def _nested(
    shape: Shape, numbers: Mapping[tuple[int, ...], float], at: tuple[int, ...] = ()
) -> Any:
    """Return lists of a shape with these numbers."""
    if not shape:
        return numbers[at]
    return [_nested(shape[1:], numbers, (*at, k)) for k in range(shape[0])]

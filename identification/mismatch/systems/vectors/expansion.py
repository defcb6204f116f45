"""Replace the vectors and matrices of a model file by their elements before it is read.

Vectors are: a parameter with a list as value, a state with a `length`, an input or output with a
list of roles, a seam whose equation gives a vector. Elements are named `angle_1`, `angle_2`, those
of a matrix `stiffness_1_2`. The value of a key applies to all elements, or is a list with one value
each; the name of another vector of the same shape is replaced by those of its elements.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from slipbench.identification.mismatch.systems.vectors.arrays import MADE_BY, Array
from slipbench.identification.mismatch.systems.vectors.element import Shape, element_names, in_words
from slipbench.identification.mismatch.systems.vectors.equation import elements
from slipbench.identification.mismatch.systems.vectors.shapes import (
    LENGTH,
    ROLE,
    Tree,
    check_names,
    check_states,
    declared_shape,
    list_shape,
)
from slipbench.protocol.errors import InputError

PARTS = ("parameters", "inputs", "states", "seams", "outputs")
EQUATIONS = {"seams": "value", "states": "rate", "outputs": "value"}
"""Key of the equation in an entry of each part, in the order in which shapes become known."""


def without_vectors(tree: Tree, where: str) -> dict[str, Any]:
    """Return the contents of a model file with elements in place of vectors and matrices.

    Other entries are returned unchanged, faults included. where: name of the file, for messages.
    Raises InputError where shapes do not agree.
    """
    parts = {part: entries for part in PARTS if isinstance(entries := tree.get(part), Mapping)}
    own = {
        (part, name): declared_shape(part, entry, f"{where}: {part}.{name}")
        for part, entries in parts.items()
        for name, entry in entries.items()
        if isinstance(entry, Mapping)
    }
    texts = _texts(parts, own, where)
    own |= {key: text.shape for key, text in texts.items() if key[0] == "seams"}
    shapes = {name: shape for (_, name), shape in own.items() if shape}
    if shapes:
        check_names(parts, shapes, where)
        check_states(parts.get("states", {}), shapes, where)
    expanded = dict(tree)
    for part, entries in parts.items():
        expanded[part] = {}
        for name, entry in entries.items():
            shape = own.get((part, name), ())
            owner = _Entry(part, name, shape, shapes, f"{where}: {part}.{name}")
            has_elements = isinstance(entry, Mapping) and (shape or part != "parameters")
            expanded[part] |= (
                owner.elements(entry, texts.get((part, name))) if has_elements else {name: entry}
            )
    return expanded


def _texts(
    parts: Mapping[str, Tree], own: Mapping[tuple[str, str], Shape], where: str
) -> dict[tuple[str, str], Array]:
    """Return the texts of all equations, by part and name. own: shapes that entries declare."""
    known = {name: shape for (part, name), shape in own.items() if shape and part != "outputs"}
    texts: dict[tuple[str, str], Array] = {}
    for part, key in EQUATIONS.items():
        for name, entry in parts.get(part, {}).items():
            if isinstance(entry, Mapping) and isinstance(entry.get(key), str):
                at = f"{where}: {part}.{name}.{key}"
                texts[part, name] = found = elements(entry[key], known, at)
                if part == "seams" and found.shape:
                    known[name] = found.shape
    return texts


@dataclass(frozen=True)
class _Entry:
    """An entry of a part. shape: its own; shapes: of every vector of the file, by name."""

    part: str
    name: str
    shape: Shape
    shapes: Mapping[str, Shape]
    where: str

    def elements(self, entry: Tree, texts: Array | None) -> dict[str, Any]:
        """Return the entries of its elements by name. texts: of its equation."""
        key = EQUATIONS.get(self.part, "")
        if texts is not None:
            self._check(texts.shape, key, f"{entry[key]}", each=self.part == "states")
        return {
            name: {
                k: texts[index if texts.shape else ()]
                if k == key and texts is not None
                else self._value(k, v, index)
                for k, v in entry.items()
                if k != LENGTH or self.part != "states"
            }
            for index, name in element_names(self.name, self.shape).items()
        }

    def _value(self, key: str, value: Any, index: tuple[int, ...]) -> Any:
        """Return the value of a key for one element."""
        if isinstance(value, list):
            self._check(list_shape(value, f"{self.where}.{key}"), key, f"{value}")
            for k in index:
                value = value[k]
            return value
        if isinstance(value, Mapping):
            return {
                k: self._value(f"{key}.{k}", v, index) if isinstance(v, list) else v
                for k, v in value.items()
            }
        if key == ROLE and self.shape:
            self._check((), key, repr(value))
        if isinstance(value, str) and value in self.shapes and key != ROLE:
            self._check(self.shapes[value], key, value)
            return element_names(value, self.shape)[index]
        return value

    def _check(self, found: Shape, key: str, shown: str, each: bool = False) -> None:
        """Raise InputError unless a shape is that of the entry. each: a number is valid as well."""
        if found != self.shape and not (each and not found):
            raise InputError(
                "shapes do not agree",
                where=f"{self.where}.{key}",
                expected=in_words(self.shape),
                found=f"{in_words(found)} in {shown[:60]}",
                remedy="" if self.shape else MADE_BY,
            )

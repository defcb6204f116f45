"""Vectors and matrices of a model file: it becomes the same file of numbers before it is read.

A parameter with a list for its value, a state with a `length`, an input or output with a list of
roles, a seam whose equation gives one. Each becomes its elements, `angle_1`, `angle_2`, and those of
a matrix `stiffness_1_2`. A key of a vector is one for all elements, or a list of one each; the name
of another vector of the same length stands for its elements.
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

    What is no vector stays as it is, faults included. where: name of the file, for messages. Raises
    InputError where shapes do not agree.
    """
    entries = {part: _tables(tree.get(part)) for part in PARTS}
    own = {
        (part, name): declared_shape(part, entry, f"{where}: {part}.{name}")
        for part, told in entries.items()
        for name, entry in told.items()
    }
    shapes = {name: shape for (_, name), shape in own.items() if shape}
    known = {n: s for n, s in shapes.items() if n not in entries["outputs"]}
    texts: dict[tuple[str, str], Array] = {}
    for part, key in EQUATIONS.items():
        for name, entry in entries[part].items():
            if isinstance(entry.get(key), str):
                at = f"{where}: {part}.{name}.{key}"
                found = texts[part, name] = elements(entry[key], known, at)
                if part == "seams" and found.shape:
                    own[part, name] = shapes[name] = known[name] = found.shape
    made = dict(tree)
    if shapes:
        check_names(entries, shapes, where)
        check_states(entries["states"], shapes, where)
    for part, told in entries.items():
        for name, entry in told.items():
            owner = _Entry(part, name, own[part, name], shapes, f"{where}: {part}.{name}")
            if owner.shape or part != "parameters":
                made[part] = _replaced(
                    made[part], name, owner.elements(entry, texts.get((part, name)))
                )
    return made


def _tables(told: Any) -> Mapping[str, Tree]:
    """Return the entries of a part that are tables; what is none is for the reader to refuse."""
    if not isinstance(told, Mapping):
        return {}
    return {name: entry for name, entry in told.items() if isinstance(entry, Mapping)}


def _replaced(part: Tree, name: str, by: Tree) -> dict[str, Any]:
    """Return a part with other entries in the place of one."""
    made: dict[str, Any] = {}
    for key, entry in part.items():
        made |= by if key == name else {key: entry}
    return made


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

    def _value(self, key: str, told: Any, index: tuple[int, ...]) -> Any:
        """Return what a key says of one element."""
        if isinstance(told, list):
            self._check(list_shape(told, f"{self.where}.{key}"), key, f"{told}")
            for k in index:
                told = told[k]
            return told
        if isinstance(told, Mapping):
            return {
                k: self._value(f"{key}.{k}", v, index) if isinstance(v, list) else v
                for k, v in told.items()
            }
        if key == ROLE and self.shape:
            self._check((), key, repr(told))
        if isinstance(told, str) and told in self.shapes and key != ROLE:
            self._check(self.shapes[told], key, told)
            return element_names(told, self.shape)[index]
        return told

    def _check(self, found: Shape, key: str, shown: str, each: bool = False) -> None:
        """Raise InputError unless a shape is that of the entry. each: or a number for each."""
        if found != self.shape and not (each and not found):
            raise InputError(
                "shapes do not agree",
                where=f"{self.where}.{key}",
                expected=in_words(self.shape),
                found=f"{in_words(found)} in {shown[:60]}",
                remedy="" if self.shape else MADE_BY,
            )

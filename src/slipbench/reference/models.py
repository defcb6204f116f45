"""Tables of a file that a pydantic model reads."""

import types
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from slipbench.protocol.configuration import InSI, Section, Unit
from slipbench.protocol.quantity import UNITS, Between, BetweenBy, Whole
from slipbench.reference.example import examples
from slipbench.reference.meanings import meanings, prose
from slipbench.reference.page import Key, Table

KINDS = {str: "text", bool: "true, false", int: "whole number", float: "number"}


@dataclass(frozen=True)
class Shape:
    """What an annotation says: the kind of a value, its unit, its bounds, tables inside."""

    kind: str
    bounds: str = ""
    inner: tuple[tuple[str, type[Section]], ...] = ()  # path below the key, model


def tables(model: type[Section], example: Mapping[str, Any] | None = None) -> tuple[Table, ...]:
    """Tables of a file, in the order in which the file's model names them; each model once.

    example: contents of a file that uses every key.
    """
    return tuple(_table(one, paths, example or {}) for one, paths in models(model).items())


def models(model: type[Section]) -> dict[type[Section], list[str]]:
    """A file's model and those of the tables in it, each with its places in the file."""
    places: dict[type[Section], list[str]] = {model: [""]}
    queue = [model]
    for one in queue:
        for name, field in one.model_fields.items():
            for below, inner in _field_shape(field).inner:
                if inner not in places:
                    queue.append(inner)
                path = f"{places[one][0]}.{_key(name, field)}{below}".lstrip(".")
                places.setdefault(inner, []).append(path)
    return places


def _table(model: type[Section], paths: list[str], example: Mapping[str, Any]) -> Table:
    found, shown = meanings(model), examples(example, paths)
    rows = (_row(_key(name, field), field, found) for name, field in model.model_fields.items())
    keys = tuple(replace(row, example=shown.get(row.name, "")) for row in rows)
    title = ", ".join(f"`{path}`" for path in dict.fromkeys(paths) if path)
    return Table(title or "Top level", prose(model), keys)


def _row(key: str, field: FieldInfo, found: dict[str, str]) -> Key:
    shape = _field_shape(field)
    models = [model for _, model in shape.inner]
    meaning = found.get(key) or (prose(models[0]).split("\n\n")[0] if models else "")
    return Key(key, shape.kind, _default(field), shape.bounds, meaning)


def _key(name: str, field: FieldInfo) -> str:
    return field.alias or name


def _field_shape(field: FieldInfo) -> Shape:
    return _restricted(_shape(field.annotation), tuple(field.metadata))


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    value = field.default
    if value is PydanticUndefined or value in ((), "", {}):
        return ""
    if isinstance(value, Section):
        stated = value.model_dump(exclude_unset=True)
        return ", ".join(f"{name} = {_written(one)}" for name, one in stated.items())
    if value is None:
        return "none"
    if isinstance(value, tuple):
        return f"[{', '.join(map(_written, value))}]"
    return _written(value)


def _written(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)


def _shape(annotation: Any) -> Shape:
    """Kind, bounds and inner tables of an annotation."""
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _restricted(_shape(parts[0]), parts[1:])
    if origin in (Union, types.UnionType):
        return _union([part for part in parts if part is not type(None)])
    if origin is Literal:
        return Shape(" or ".join(f'"{p}"' if isinstance(p, str) else f"{p}" for p in parts))
    if origin is tuple:
        return _sequence(parts)
    if origin is dict:
        value = _shape(parts[1])
        inner = tuple((f".NAME{below}", model) for below, model in value.inner)
        return Shape(f"table: name = {value.kind}", value.bounds, inner)
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return Shape("table", "", (("", annotation),))
    return Shape(KINDS[annotation])


def _union(parts: list[Any]) -> Shape:
    shapes = [_shape(part) for part in parts]
    kinds = dict.fromkeys(shape.kind for shape in shapes)
    inner = tuple(one for shape in shapes for one in shape.inner)
    if len(parts) > 1 and len(inner) == len(parts):  # told apart by a key with a fixed value
        inner = tuple((f", {_variant(model)}", model) for _, model in inner)
    return Shape(" or ".join(kinds), _joined(shape.bounds for shape in shapes), inner)


def _variant(model: type[Section]) -> str:
    """Key and values that choose one table among several: the first key with fixed values."""
    for name, field in model.model_fields.items():
        if get_origin(field.annotation) is Literal and name in ("waveform", "kind"):
            return f"{name} = {_shape(field.annotation).kind}"
    return model.__name__


def _sequence(parts: tuple[Any, ...]) -> Shape:
    if parts[-1] is Ellipsis:
        item = _shape(parts[0])
        inner = tuple((f"[]{below}", model) for below, model in item.inner)
        return Shape(f"list of: {item.kind}", item.bounds, inner)
    if len(set(parts)) == 1:
        item = _shape(parts[0])
        return Shape(f"list of {len(parts)}: {item.kind}", item.bounds)
    raise TypeError(f"no words for a list of {parts}")


def _restricted(shape: Shape, metadata: tuple[Any, ...]) -> Shape:
    kind, bounds = shape.kind, [shape.bounds]
    for one in metadata:
        if isinstance(one, Between):
            kind = ", ".join(UNITS[one.kind])
        elif isinstance(one, BetweenBy):
            kind = "; ".join(f"{k}: {', '.join(UNITS[b.kind])}" for k, b in one.bounds.items())
        elif isinstance(one, InSI | Unit):
            kind = one.unit
        bounds += [
            _bounds(part) for part in (one.metadata if isinstance(one, FieldInfo) else [one])
        ]
    return Shape(kind, _joined(bounds), shape.inner)


def _bounds(one: Any) -> str:
    """Bounds that one annotation states, with its reason where it has one."""
    if isinstance(one, Between | Whole):
        return f"{one.low} to {one.high}, because {one.reason}"
    if isinstance(one, BetweenBy):
        return "; ".join(f"{key}: {_bounds(b)}" for key, b in one.bounds.items())
    return _joined(_constraints(one))


def _constraints(one: Any) -> Iterator[str]:
    for name, words in (
        ("ge", "at least {}"),
        ("gt", "above {}"),
        ("le", "at most {}"),
        ("lt", "below {}"),
        ("min_length", "number of entries at least {}"),
        ("max_length", "length at most {}"),
        ("pattern", "`{}`"),
    ):
        value = getattr(one, name, None)
        if value is not None:
            yield words.format(f"{value:g}" if isinstance(value, float) else value)


def _joined(parts: Any) -> str:
    return ", ".join(dict.fromkeys(part for part in parts if part))

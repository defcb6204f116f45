"""Examples of keys, from a file that uses every one of them."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

MOST = 40
"""Characters of an example; a longer value is seen in the file itself."""


def examples(tree: Mapping[str, Any], paths: Sequence[str]) -> dict[str, str]:
    """Example of each key of a table. paths: places of the table, as in `inputs.NAME.size`."""
    found: dict[str, str] = {}
    for path in paths:
        for table in _at(tree, path.split(".") if path else []):
            for key, value in table.items():
                found.setdefault(key, _written(f"{key}", value))
    return found


def _at(tree: Any, path: Sequence[str]) -> Iterator[Mapping[str, Any]]:
    """Yield the tables at a path; NAME is any key, [] any entry of a list."""
    if not path:
        if isinstance(tree, Mapping):
            yield tree
        return
    if not isinstance(tree, Mapping):
        return
    name = path[0].removesuffix("[]")
    inner = list(tree.values()) if name == "NAME" else [tree[name]] if name in tree else []
    for one in inner:
        for each in one if path[0].endswith("[]") else [one]:
            yield from _at(each, path[1:])


def _written(key: str, value: Any) -> str:
    """Value as in the file, or the heading of its table."""
    if isinstance(value, Mapping) and any(isinstance(v, Mapping) for v in value.values()):
        return f"[{key}.{next(iter(value))}]"
    if isinstance(value, list) and value and isinstance(value[0], Mapping):
        return f"[[{key}]]"
    text = _value(value)
    return text if len(text) <= MOST else f"{text[: MOST - 4]} ..."


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{k} = {_value(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else f"{value:g}"

"""A TOML text with new numbers: comments, order, units and everything else stay as written."""

from collections.abc import Callable, Mapping
from typing import Any

import tomlkit
from tomlkit.items import AoT

DIGITS = 9
"""Significant digits of a new value; more are noise of the conversion, not of the estimate."""
DIGITS_OF_HALF_WIDTH = 4

Linear = Callable[[str, str], tuple[float, float]]
"""(unit, to) -> slope and offset with value_in_to = slope * value_in_unit + offset."""


def edited(text: str, changes: Mapping[str, Any], linear: Linear) -> str:
    """Return a TOML text with changes.

    changes: tree of what changes; a quantity is `{value, unit, plus_minus}` and is written in the
    unit that the text has for it. A list of trees holds tables: a table of the text with the same
    words is changed, else a new one is appended. Other lists are values.
    """
    document = tomlkit.parse(text)
    _merge(document, changes, linear)
    return tomlkit.dumps(document)


def _merge(into: Any, changes: Mapping[str, Any], linear: Linear) -> None:
    for key, value in changes.items():
        if isinstance(value, list) and all(isinstance(v, Mapping) for v in value):
            _merge_tables(into, key, value, linear)
        elif key not in into:
            into[key] = _item(value) if is_quantity(value) else _new(value)
        elif is_quantity(value) and is_quantity(into[key]):
            _set_quantity(into[key], value, linear)
        elif isinstance(value, Mapping):
            _merge(into[key], value, linear)
        elif into[key] != value:
            into[key] = value


def _merge_tables(into: Any, key: str, changes: list[Any], linear: Linear) -> None:
    if changes and key not in into:
        if isinstance(into, tomlkit.TOMLDocument) and not into.as_string().endswith("\n\n"):
            into.add(tomlkit.nl())
        into.append(key, tomlkit.aot())
    for table in changes:
        words = {k: v for k, v in table.items() if isinstance(v, str)}
        same = [t for t in into[key] if all(t.get(k, v) == v for k, v in words.items())]
        if same:
            _merge(same[0], {k: v for k, v in table.items() if k not in words}, linear)
        else:
            into[key].append(_table(table) if isinstance(into[key], AoT) else _item(table))


def is_quantity(value: Any) -> bool:
    """Whether a value of a tree is a number with a unit."""
    return isinstance(value, Mapping) and "value" in value


def _set_quantity(into: Any, changes: Mapping[str, Any], linear: Linear) -> None:
    slope, offset = linear(into.get("unit", "1"), changes["unit"])
    _set(into, "value", (changes["value"] - offset) / slope, DIGITS)
    if changes.get("plus_minus") is not None:
        _set(into, "plus_minus", changes["plus_minus"] / slope, DIGITS_OF_HALF_WIDTH)


def _set(into: Any, key: str, value: float, digits: int) -> None:
    """Set a number unless the text has the same one already, up to rounding of the conversion."""
    now = into.get(key)
    if now is None or abs(value - now) > 1e-12 * abs(value):
        into[key] = rounded(value, digits)


def rounded(value: float, digits: int = DIGITS) -> float:
    """Return a number with so many significant digits."""
    return float(f"{value:.{digits}g}")


def _new(value: Any) -> Any:
    return _table(value) if isinstance(value, Mapping) else value


def _table(tree: Mapping[str, Any]) -> Any:
    table = tomlkit.table()
    for key, value in tree.items():
        table[key] = _item(value)
    return table


def _item(value: Any) -> Any:
    if not isinstance(value, Mapping):
        return value
    inline = tomlkit.inline_table()
    for key, part in value.items():
        if isinstance(part, float):
            part = rounded(part, DIGITS_OF_HALF_WIDTH if key == "plus_minus" else DIGITS)
        inline[key] = _item(part)
    return inline

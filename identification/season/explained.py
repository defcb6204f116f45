"""Entry of an `explain`: its verdict, and the size of each effect with its interval."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from slipbench.identification.season.entry import Entry, Parameter, column
from slipbench.identification.season.folders import VERDICT
from slipbench.identification.season.json_file import number, read_json, text_at
from slipbench.protocol.errors import InputError

NO_MISMATCH, OPEN = "no mismatch", "no conclusion"


def with_verdict(entry: Entry, folder: Path) -> Entry:
    """The entry with what verdict.json in a folder has. Raises InputError where it is damaged."""
    path = folder / VERDICT
    tree = read_json(path)
    mismatch = tree.get("mismatch")
    effects = tree.get("effects")
    if not isinstance(mismatch, Mapping) or not isinstance(effects, list):
        raise InputError(
            "this is no verdict of slipbench explain",
            where=str(path),
            expected="mismatch and effects",
            found=", ".join(sorted(tree)[:8]) or "nothing",
        )
    found: dict[str, Parameter] = {}
    for effect in effects:
        for one in _parameters(effect, str(path)):
            found.setdefault(one.name, one)
    failure = text_at(tree, "failure")
    entry = replace(
        entry,
        verdict=_words(tree, mismatch.get("found"), effects),
        reason=text_at(tree, "sentence"),
        parameters=tuple(found[name] for name in sorted(found)),
        training=_training(tree),
    )
    return entry.with_faults(f"the analysis failed in {failure}") if failure else entry


def _words(tree: Mapping[str, Any], found: object, effects: list[Any]) -> str:
    if found is None:
        return OPEN
    if not found:
        return NO_MISMATCH
    names = [_effect_name(effect) for effect in effects]
    unknown = tree.get("unknown")
    if isinstance(unknown, Mapping) and unknown.get("found"):
        names.append("unknown effect")
    return "mismatch" + (f": {', '.join(names)}" if names else "")


def _effect_name(effect: Mapping[str, Any]) -> str:
    name, subject = text_at(effect, "name"), text_at(effect, "subject")
    return f"{name} ({subject})" if subject else name


def _parameters(effect: object, where: str) -> Iterator[Parameter]:
    """Yield the parameters of an effect, named EFFECT_PARAMETER or EFFECT_SUBJECT_PARAMETER."""
    if not isinstance(effect, Mapping) or not isinstance(effect.get("parameters"), list):
        raise InputError("an effect without a table of parameters", where=where)
    head = [text_at(effect, "name"), text_at(effect, "subject")]
    for one in effect["parameters"]:
        value = number(one.get("value")) if isinstance(one, Mapping) else None
        if value is None:
            raise InputError(f"a parameter of {head[0]} has no value", where=where)
        name = column(*head, text_at(one, "name"))
        yield Parameter(name, text_at(one, "unit"), value, *_interval(one.get("interval")))


def _interval(pair: object) -> tuple[float | None, float | None]:
    if not isinstance(pair, list) or len(pair) != 2:
        return None, None
    low, high = map(number, pair)
    if low is None or high is None or not math.isfinite(high - low):
        return None, None
    return low, high


def _training(tree: Mapping[str, Any]) -> tuple[str, ...]:
    found = tree.get("training")
    return tuple(str(one) for one in found) if isinstance(found, list) else ()

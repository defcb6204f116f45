"""Meanings of keys, from the docstring of the class that reads them.

A docstring has lines "key   meaning" with two spaces or more between; a longer meaning goes on in
lines with a deeper indent. Everything else is prose.
"""

import inspect
import re

_LINE = re.compile(r"(\w+) {2,}(\S.*)")


def meanings(model: type) -> dict[str, str]:
    """Meaning of each key that the docstring names, those of the base classes included."""
    found: dict[str, str] = {}
    for one in reversed(model.__mro__):
        found.update(_split(one)[1])
    return found


def prose(model: type) -> str:
    """Docstring without the lines on keys, its paragraphs with a blank line between."""
    return _split(model)[0]


def _split(model: type) -> tuple[str, dict[str, str]]:
    paragraphs: list[list[str]] = [[]]
    keys: dict[str, list[str]] = {}
    last = None
    for line in inspect.cleandoc(vars(model).get("__doc__") or "").splitlines():
        if found := _LINE.fullmatch(line):
            last = keys.setdefault(found[1], [])
            last.append(found[2])
        elif line.startswith("  ") and last is not None:
            last.append(line.strip())
        elif line:
            last = None
            paragraphs[-1].append(line)
        else:
            last = None
            paragraphs.append([])
    text = "\n\n".join(" ".join(lines) for lines in paragraphs if lines)
    return text, {key: " ".join(lines) for key, lines in keys.items()}

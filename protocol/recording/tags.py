"""Tags of a run: what its frames do not have, such as track, tyre, mileage and temperature.

They stand in the table [tags] of run.toml. A session plan has the same table; it goes into every run
that the session records. A number is as the user counts it (a mileage in km, a temperature in degC):
keep one unit for a key through a season.
"""

import tomllib
from collections.abc import Mapping
from datetime import date, time
from pathlib import Path
from typing import Annotated, Any

import tomlkit
from pydantic import BeforeValidator, Field

from slipbench.protocol.configuration import Section, load_toml, parse
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.run_folder import DESCRIPTION, write_description_text

TAGS = "tags"
KEY = r"^[a-z][a-z0-9_]*$"
LONGEST = 200  # characters of a value


def _checked(value: object) -> object:
    """A value of TOML that a tag may have. Raises ValueError."""
    if isinstance(value, date):  # a datetime is one, too
        return value.isoformat()
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        if not abs(value) < 1e300:
            raise ValueError("a number has to be finite")
        return float(value) if isinstance(value, float) or abs(value) >= 1 << 53 else value
    if not isinstance(value, str):
        raise ValueError("a text, a number, a date, true or false is expected")
    if not value.strip() or not value.isprintable() or len(value) > LONGEST:
        raise ValueError(f"a text has 1 to {LONGEST} printable characters")
    return value


Key = Annotated[str, Field(pattern=KEY, max_length=40)]
Value = Annotated[int | float | str, BeforeValidator(_checked)]
Tags = dict[Key, Value]


class TagTable(Section):
    """The table [tags].

    tags  what the frames do not have: small letters, digits and _ in a key, e.g. track = "Mugello"
    """

    tags: Tags = Field(default={})


def tags_of(description: Mapping[str, Any], where: str) -> dict[str, int | float | str]:
    """Tags in a description of a run: dates as ISO text, true and false as text.

    where: file, for messages. Raises InputError that names each key at fault.
    """
    return dict(parse({TAGS: description.get(TAGS, {})}, TagTable, where).tags)


def parse_tag(text: str) -> tuple[str, Any]:
    """Key and value of a text "key=value"; the value None where nothing follows the sign.

    A value that TOML reads as a number, a date, true or false is one; any other is a text. Raises
    InputError.
    """
    key, sign, value = (part.strip() for part in text.partition("="))
    if not sign:
        raise InputError(
            "this is no tag", where="--tag", expected="KEY=VALUE, as in tyre=new", found=text
        )
    found = _from_toml(value) if value else None
    tags_of({TAGS: {key: 0 if found is None else found}}, "--tag")
    return key, found


def _from_toml(text: str) -> Any:
    try:
        found = tomllib.loads(f"value = {text}")
    except ValueError:  # a word
        return text
    value = found["value"]
    return value if len(found) == 1 and not isinstance(value, list | dict | time) else text


def write_tags(run: Path, changes: Mapping[str, Any]) -> None:
    """Write these tags into run.toml of a run folder; comments and all other keys stay.

    changes: a value None removes the tag. Raises InputError where run.toml is missing or damaged, or
    cannot be written; it is then unchanged.
    """
    path = run / DESCRIPTION
    tags_of(load_toml(path), str(path))
    document: Any = tomlkit.parse(path.read_text(encoding="utf-8"))
    table = document.setdefault(TAGS, tomlkit.table())
    for key, value in changes.items():
        if value is None:
            table.pop(key, None)
        else:
            table[key] = value
    text = tomlkit.dumps(document)
    tags_of(tomllib.loads(text), str(path))
    try:
        write_description_text(run, text)
    except OSError as cause:
        raise InputError("cannot be written", where=str(path), found=str(cause)) from cause

"""A table as a logger exported it: named columns, units, and which column holds whose time."""

import difflib
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from slipbench.protocol.errors import InputError

_NAME_AND_UNIT = re.compile(r"(.*?)\s*[(\[]\s*([^()\[\]]{0,16}?)\s*[)\]]\s*")


@dataclass(frozen=True)
class Table:
    """Columns of one file, as read.

    where     the file, for messages
    data      pyarrow.Table; a column that is not all numbers is text, timestamps or truth values
    units     column -> unit, where the file states one
    clocks    column -> its time column, where the file states it
    warnings  of reading it
    """

    where: str
    data: Any
    units: Mapping[str, str] = field(default_factory=dict)
    clocks: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def names(self) -> list[str]:
        """Names of the columns, as in the file but for a unit in brackets."""
        return list(self.data.column_names)

    def find(self, title: str) -> str:
        """Name of the column called `title`: with or without its unit, or behind "MESSAGE.".

        Raises InputError where there is none.
        """
        bare = split_unit(title)[0]
        for name in (title, bare):
            if name in self.names:
                return name
        for plain in (str.casefold, _without_message):
            same = [name for name in self.names if plain(name) == bare.casefold()]
            if len(same) == 1:
                return same[0]
        near = difflib.get_close_matches(bare, self.names, n=1, cutoff=0.4)
        raise InputError(
            f"the table has no column {title!r}",
            where=self.where,
            found=", ".join(self.names[:40]),
            remedy=f"did you mean {near[0]!r}?" if near else "name one of these",
        )


def split_unit(title: str) -> tuple[str, str]:
    """Name and unit of a title such as "Throttle Pos (%)" or "Time[s]"."""
    match = _NAME_AND_UNIT.fullmatch(title.strip())
    if match and match[1].strip():
        return match[1].strip(), match[2]
    return title.strip(), ""


def _without_message(name: str) -> str:
    """Name of a signal, in small letters, without the message before it: "ID_140.RPM" -> "rpm"."""
    return name.rpartition(".")[2].casefold()

"""A page of the reference: tables of keys, as Markdown."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Key:
    """One key of a file, as a user reads it.

    unit: or the kind of value where it is no number. example: as in a file; empty: none.
    """

    name: str
    unit: str
    default: str
    bounds: str
    meaning: str
    example: str = ""

    def cells(self, example: bool = False) -> tuple[str, ...]:
        """Cells of its row. example: whether it ends with an example."""
        told = (f"`{self.name}`", self.unit, self.default, self.bounds, self.meaning)
        return (*told, f"`{self.example}`" if self.example else "") if example else told


@dataclass(frozen=True)
class Table:
    """One table of a file: title, prose, and its keys."""

    title: str
    text: str
    keys: tuple[Key, ...]

    def markdown(self) -> str:
        """Heading, prose and rows."""
        shows = any(key.example for key in self.keys)
        head = ("key", "unit or kind", "default", "allowed", "meaning", "example")[: 5 + shows]
        rows = grid(head, (key.cells(shows) for key in self.keys)) if self.keys else ""
        return f"## {self.title}\n\n" + "\n\n".join(part for part in (self.text, rows) if part)


@dataclass(frozen=True)
class Page:
    """One page: the reference of one kind of file. source: the module that reads the file."""

    file: str
    title: str
    text: str
    source: str
    parts: tuple[Table | str, ...]

    def tables(self) -> tuple[Table, ...]:
        """Tables of keys."""
        return tuple(part for part in self.parts if isinstance(part, Table))

    def markdown(self) -> str:
        """Text of the page."""
        made = f"Made by `make reference` from `{self.source}`."
        bodies = [part if isinstance(part, str) else part.markdown() for part in self.parts]
        return "\n\n".join([f"# {self.title}", f"{self.text}\n\n{made}", *bodies]) + "\n"


def grid(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(_cell, line)) + " |" for line in lines)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")

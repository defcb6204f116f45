"""An error in a user's file, in five parts: what, where, expected, found, remedy."""

from collections.abc import Iterable
from difflib import get_close_matches


class PlantError(ValueError):
    """A complaint about the motorcycle's description, in words that lead to its cure."""

    def __init__(self, what: str, where: str, expected: str, found: str, remedy: str) -> None:
        super().__init__(f"{where}: {what}; expected {expected}, found {found}; {remedy}")
        self.what = what
        self.where = where
        self.expected = expected
        self.found = found
        self.remedy = remedy


class ParameterError(PlantError):
    """A parameter lies outside the range in which its equation means anything."""


class VehicleFileError(PlantError):
    """A vehicle file cannot be read as a motorcycle."""


def nearest(word: str, known: Iterable[str]) -> str:
    """The remedy for a misspelt word: the known one nearest to it, or all of them."""
    known = sorted(known)
    match = get_close_matches(word, known, n=1, cutoff=0.5)
    return f"did you mean '{match[0]}'?" if match else f"known are: {', '.join(known)}"

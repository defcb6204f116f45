"""Verdict on a run, as it stands at the head of its report."""

from dataclasses import dataclass
from typing import Literal

Word = Literal["good", "usable with reservations", "not usable"]
STYLES: dict[Word, str] = {
    "good": "good",
    "usable with reservations": "reservations",
    "not usable": "unusable",
}


@dataclass(frozen=True)
class RunVerdict:
    """Whether a run can be identified from, and why; at least one reason."""

    word: Word
    reasons: tuple[str, ...]

    @property
    def style(self) -> str:
        """Class of the verdict in the style sheet."""
        return STYLES[self.word]

    def __str__(self) -> str:
        """Verdict in one line."""
        return f"{self.word}: {'; '.join(self.reasons)}"

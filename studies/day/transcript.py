"""Output of the commands of a day, kept in its folder as they came, each with its duration.

Lines of the transcript: "$ slipbench ..." a command; "# 93 s" how long the command before it took.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

NAME = "transcript.txt"
Say = Callable[[str], None]


@dataclass(frozen=True)
class Step:
    """A command with the lines that it printed. seconds: its duration."""

    command: str
    lines: tuple[str, ...]
    seconds: int

    @property
    def name(self) -> str:
        """The sub-command."""
        return self.command.split()[0]


def kept(folder: Path, say: Say) -> Say:
    """A receiver of lines that also appends them to the transcript of a folder."""

    def both(line: str) -> None:
        with (folder / NAME).open("a", encoding="utf-8") as file:
            file.write(line + "\n")
        say(line)

    return both


def steps(text: str) -> list[Step]:
    """Commands of a transcript in their order; one that did not end is left out."""
    found = []
    for part in re.split(r"^\$ slipbench ", text, flags=re.MULTILINE)[1:]:
        command, *lines = part.splitlines()
        ends = [i for i, line in enumerate(lines) if re.fullmatch(r"# \d+ s", line)]
        if ends:
            found.append(Step(command, tuple(lines[: ends[0]]), int(lines[ends[0]].split()[1])))
    return found

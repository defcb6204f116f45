"""A how-to page, run as written: its blocks one after another, in a folder that is empty at first.

sh      commands, as in one shell: the working folder carries over. One that fails fails the page.
text    lines that the output of the commands before has, in this order; a line "..." stands for any
        others. Numbers may differ by TOLERANCE.
toml    `# in FILE` in the first line: these keys replace those of the file.
python  `# FILE` in the first line: the file is written; else the block is run.

A comment `<!-- needs: vcan0 -->` before a block names an interface: the block is run only where it
exists. Other blocks always run.
"""

import math
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomlkit

from tests.paths import ROOT

HOW_TO = ROOT / "docs" / "how_to"
TOLERANCE = 0.05
BLOCK = re.compile(r"(?:<!-- needs: (\w+) -->\n+)?```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?")


@dataclass(frozen=True)
class Block:
    """One fenced block: the interface that it needs, or none; its language, its text."""

    needs: str
    language: str
    text: str


def blocks(page: str, section: str = "") -> list[Block]:
    """Blocks of a page, or of the section with this heading, in order."""
    text = (HOW_TO / page).read_text(encoding="utf-8")
    if section:
        text = text.split(f"\n## {section}\n")[1].split("\n## ")[0]
    return [Block(*found) for found in BLOCK.findall(text)]


@dataclass
class Reader:
    """Does what a page says. skipped: interfaces that blocks need and that are not there."""

    folder: Path
    interfaces: frozenset[str] = frozenset()
    output: str = ""
    skipped: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.at = self.folder
        tools = self.folder.parent / "tools"
        tools.mkdir(exist_ok=True)
        for name, arguments in (("slipbench", "-m slipbench "), ("python", "")):
            (tools / name).write_text(f'#!/bin/sh\nexec {sys.executable} {arguments}"$@"\n')
            (tools / name).chmod(0o755)
        self.environment = os.environ | {
            "PATH": f"{tools}:{os.environ['PATH']}",
            "PYTHONPATH": str(ROOT / "src"),
            "COLUMNS": "200",
            "NO_COLOR": "1",
        }

    def follow(self, page: str, section: str = "") -> None:
        """Run the blocks of a page or section; the output of one that is skipped is not expected."""
        skipped = False
        for block in blocks(page, section):
            if block.language == "text" and skipped:
                continue
            skipped = bool(block.needs) and block.needs not in self.interfaces
            if skipped:
                self.skipped.add(block.needs)
            else:
                getattr(self, f"_{block.language}")(block.text)

    def _sh(self, text: str) -> None:
        state = self.folder.parent / "at"
        script = f"set -euo pipefail\n{text}\npwd > '{state}'\n"
        self._run("bash", "-c", script)
        self.at = Path(state.read_text(encoding="utf-8").strip())

    def _python(self, text: str) -> None:
        if found := re.match(r"# ([\w/]+\.py)\n", text):
            (self.at / found[1]).write_text(text, encoding="utf-8")
        else:
            self._run(sys.executable, "-c", text)

    def _toml(self, text: str) -> None:
        found = re.match(r"# in (\S+\.toml)\n", text)
        assert found, f"no file is named: {text}"
        path = self.at / found[1]
        document = tomlkit.parse(path.read_text(encoding="utf-8"))
        _merge(document, tomlkit.parse(text))
        path.write_text(tomlkit.dumps(document), encoding="utf-8")

    def _text(self, text: str) -> None:
        lines = iter(self.output.splitlines())
        anywhere = True
        for expected in text.splitlines():
            if expected.strip() == "...":
                anywhere = True
                continue
            assert _found(expected, lines, anywhere), f"{expected!r} is not in\n{self.output}"
            anywhere = False

    def _run(self, *command: str) -> None:
        done = subprocess.run(
            command,
            cwd=self.at,
            env=self.environment,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            check=False,
        )
        self.output = done.stdout
        assert done.returncode == 0, f"{command[-1]}\n{done.stdout}"


def _merge(into: Any, new: Any) -> None:
    for key, value in new.items():
        if isinstance(value, dict) and key in into:
            _merge(into[key], value)
        else:
            into[key] = value


def _found(expected: str, lines: Iterator[str], anywhere: bool) -> bool:
    """Whether the next line, or any of the next, is the expected one."""
    for line in lines:
        if agrees(line, expected):
            return True
        if not anywhere:
            return False
    return False


def agrees(line: str, expected: str) -> bool:
    """Whether two lines have the same words and, within TOLERANCE, the same numbers."""
    words = [" ".join(NUMBER.sub("#", text).split()) for text in (line, expected)]
    if words[0] != words[1]:
        return False
    pairs = zip(NUMBER.findall(line), NUMBER.findall(expected), strict=True)
    return all(math.isclose(float(a), float(b), rel_tol=TOLERANCE) for a, b in pairs)

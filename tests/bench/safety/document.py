"""Figures in docs/safety.md are put there by the commands that measured them."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[3] / "docs" / "safety.md"


def write(section: str, lines: list[str]) -> None:
    """Replace what stands between the marks of `section`; raises ValueError where it has none."""
    text = PAGE.read_text(encoding="utf-8")
    begin, end = f"<!-- measured: {section} -->\n", f"<!-- end: {section} -->"
    pattern = re.compile(re.escape(begin) + ".*?" + re.escape(end), re.DOTALL)
    new, number = pattern.subn(lambda _: begin + "\n".join(lines) + "\n" + end, text)
    if number != 1:
        raise ValueError(f"{PAGE} has no section {section!r}")
    PAGE.write_text(new, encoding="utf-8")

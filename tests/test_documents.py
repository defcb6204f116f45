"""What the documents point to exists, and nothing tells where the project was made."""

import re
import subprocess
from pathlib import Path

import pytest

from tests.paths import ROOT

TOP = (
    "bench|controllers|dbc|docs|examples|identification|plant|protocol|src|studies|tests|benchmarks"
)
LINK = re.compile(r"\]\((?!https?://|#|mailto:)([^)#\s]+)")
PATH = re.compile(rf"`((?:{TOP})/[\w./-]*)`")
# Folders of one machine or one person: of no use to anybody else.
PLACES = re.compile(
    r"(?<![\w.$}~-])/(?:" + "|".join(["work", "root", "home", "Users", "opt"]) + r")/\w"
)
TEXT = {".c", ".cfg", ".dbc", ".json", ".lock", ".md", ".py", ".sh", ".toml", ".txt", ".yml", ""}


def tracked() -> list[Path]:
    """Every file that the project keeps."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if listed.returncode:
        pytest.skip("not a git checkout: which files belong to the project is not known")
    paths = [ROOT / name for name in listed.stdout.split("\0") if name]
    return [path for path in paths if path.is_file()]


def documents() -> list[Path]:
    return [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]


@pytest.mark.parametrize("document", documents(), ids=lambda path: str(path.relative_to(ROOT)))
def test_what_a_document_points_to_exists(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    links = [document.parent / target for target in LINK.findall(text)]
    paths = [ROOT / target for target in PATH.findall(text)]
    assert [str(path.relative_to(ROOT)) for path in links + paths if not path.exists()] == []


def test_no_file_tells_where_it_was_made() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in tracked()
        if path.suffix in TEXT
        for number, line in enumerate(path.read_text("utf-8", "replace").splitlines(), start=1)
        if PLACES.search(line)
    ]
    assert found == []

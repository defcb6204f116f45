"""Where the real recordings are; tests that need one skip where they are not."""

import os
from pathlib import Path

import pytest

FOLDER = Path(
    os.environ.get("SLIPBENCH_RECORDINGS", Path(__file__).parents[2] / "shared" / "recordings")
)


def told() -> str:
    """Say at the head of a test run whether the real recordings are there."""
    if FOLDER.is_dir():
        return f"real recordings: {FOLDER}"
    return (
        f"real recordings: none at {FOLDER}, so their tests skip; set SLIPBENCH_RECORDINGS to"
        " their folder"
    )


def recording(name: str) -> Path:
    """Path of a real recording below the folder, or a skip that says how to enable the test."""
    path = FOLDER / name
    if not path.exists():
        pytest.skip(f"no real recording {name}: set SLIPBENCH_RECORDINGS to the folder that has it")
    return path

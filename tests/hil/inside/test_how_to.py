"""The how-to page on a device in the loop, run as written on a real CAN interface."""

import shutil
from pathlib import Path

from tests.bench.bus.wires import VCAN
from tests.how_to.page import Reader
from tests.paths import ROOT


def test_your_ecu(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    shutil.copytree(ROOT / "examples" / "hil", folder / "examples" / "hil")
    reader = Reader(folder, frozenset({VCAN}))
    reader.follow("your_ecu.md")
    assert reader.skipped == set()

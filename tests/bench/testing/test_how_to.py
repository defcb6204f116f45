"""The how-tos on tests run as written."""

import re
from pathlib import Path

import pytest

from slipbench.bench.testing.plugin import OPTIONS
from slipbench.bench.testing.setup import Choice, Setup
from tests.bench.testing.conftest import Run
from tests.paths import ROOT

pytest_plugins = ["pytester"]

HOW_TO = ROOT / "docs" / "how_to"


def test_file(page: str) -> str:
    """The file of tests that a page shows."""
    text = (HOW_TO / page).read_text(encoding="utf-8")
    found = re.findall(r"```python\n(# test_\w+\.py\n.*?)```", text, re.DOTALL)
    assert len(found) == 1
    return found[0]


test_file.__test__ = False  # type: ignore[attr-defined]


def test_a_test_in_pytest(run: Run, pytester: pytest.Pytester) -> None:
    result = run(test_file("pytest.md"), "--slipbench-report", "report.html")
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(["passed*SAF-3*hand-back*ms*at most 26 ms*", "SAF-3: passed*"])
    assert (pytester.path / "report.html").exists()


def test_every_option_is_on_the_page_with_its_default() -> None:
    text = (HOW_TO / "pytest.md").read_text(encoding="utf-8")
    for name, default, _ in OPTIONS:
        assert re.search(rf"--{name}`.*`{default}`", text), name


def test_replay_as_a_test(run: Run, pytester: pytest.Pytester, tmp_path: Path) -> None:
    options = {name: default for name, default, _ in OPTIONS}
    bench = Setup(Choice.of(options), tmp_path, "drive")
    bench.vehicle  # noqa: B018
    bench.bus.run("1 s")
    bench.recording.save().rename(pytester.path / "drive")
    bench.close()
    run(test_file("replay_as_a_test.md")).assert_outcomes(passed=4)

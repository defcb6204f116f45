"""Measurements and requirements of a run in the terminal, and as a page where it is wanted.

The reports of tests carry them as plain data, so that they also come from other processes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipbench.bench.testing.measurements import LATENESS, Measurement

if TYPE_CHECKING:
    import pytest


ORDER = ("not tested", "passed", "in doubt", "failed")  # verdicts, the worst last


@dataclass
class TestResult:
    """One test: its name, outcome, measurements, requirements, and plots where it failed."""

    __test__ = False  # not a test, whatever its name

    name: str
    outcome: str
    text: str = ""
    measurements: list[Measurement] = field(default_factory=list)
    requirements: list[str] = field(default_factory=list)
    plots: list[dict[str, Any]] = field(default_factory=list)


class Summary:
    """Collects the results of tests that use slipbench."""

    def __init__(self, page: str | None) -> None:
        """Write an HTML page to `page` at the end; None: none."""
        self._page = page
        self._results: dict[str, TestResult] = {}

    @property
    def results(self) -> list[TestResult]:
        """Results in the order in which the tests ended."""
        return list(self._results.values())

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Store the content of the report of a test."""
        described = getattr(report, "slipbench", None)
        if described is None:
            return
        result = self._results.setdefault(report.nodeid, TestResult(report.nodeid, "passed"))
        result.measurements = [Measurement(**each) for each in described["measurements"]]
        result.requirements = described["requirements"]
        if report.outcome != "passed":
            result.outcome = report.outcome
            result.text = _text(report)
            result.plots = described.get("plots", [])

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Print the measurements, then the verdict on each requirement."""
        if not self._results:
            return
        if any(result.measurements for result in self.results):
            terminalreporter.section("measurements")
            for line, bad in measurement_lines(self.results):
                terminalreporter.line(line, red=bad)
        verdicts = requirement_verdicts(self.results)
        if verdicts:
            terminalreporter.section("requirements")
            for name, (verdict, tests) in verdicts.items():
                number = f"{len(tests)} test{'s' if len(tests) > 1 else ''}"
                line = f"{name}: {verdict} ({number})"
                terminalreporter.line(line, red=verdict in ("failed", "in doubt"))

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Write the page; in a worker process of pytest-xdist, leave it to the main process."""
        if self._page is None or hasattr(session.config, "workerinput"):
            return
        from slipbench.bench.testing.report_page import page

        options = session.config.invocation_params.args
        Path(self._page).write_text(
            page(self.results, " ".join(map(str, options))), encoding="utf-8"
        )


def measurement_lines(results: list[TestResult]) -> Iterator[tuple[str, bool]]:
    """One line for each measurement, columns aligned, and whether it is outside its limits."""
    rows = [(each, result) for result in results for each in result.measurements]
    widths = [
        max(len(text) for text in column)
        for column in zip(*(_columns(each) for each, _ in rows), strict=True)
    ]
    for each, result in rows:
        cells = [text.ljust(width) for text, width in zip(_columns(each), widths, strict=True)]
        yield f"{'  '.join(cells)}  {result.name.rpartition('::')[2]}", not each.inside


def _columns(each: Measurement) -> tuple[str, str, str, str, str]:
    return each.verdict, each.requirement, each.name, each.shown, each.limits


def requirement_verdicts(results: list[TestResult]) -> dict[str, tuple[str, list[str]]]:
    """Verdict and tests of each requirement, in order of their names.

    "failed" where a test with its marker failed or a measurement for it is outside its limits;
    "in doubt" where the test itself was late beyond its limit, so that it may have caused what it
    found; "not tested" where every test was skipped; else "passed".
    """
    found: dict[str, tuple[str, list[str]]] = {}
    for result in results:
        for name, verdict in _verdicts(result).items():
            before, tests = found.get(name, ("not tested", []))
            found[name] = (max(before, verdict, key=ORDER.index), [*tests, result.name])
    return dict(sorted(found.items(), key=lambda item: _natural(item[0])))


def _verdicts(result: TestResult) -> dict[str, str]:
    """Verdict of one test on each of its requirements."""
    ran = result.outcome if result.outcome in ORDER else "not tested"
    verdicts = dict.fromkeys(result.requirements, ran)
    for each in result.measurements:
        if each.requirement:
            before = verdicts.get(each.requirement, "passed")
            verdicts[each.requirement] = before if each.inside else "failed"
    if any(each.name == LATENESS and not each.inside for each in result.measurements):
        return dict.fromkeys(verdicts, "in doubt")
    return verdicts


def _natural(name: str) -> tuple[str, int]:
    """Key that puts SAF-10 after SAF-9."""
    head = name.rstrip("0123456789")
    return head, int(name[len(head) :] or 0)


def _text(report: pytest.TestReport) -> str:
    sections = [content for title, content in report.sections if title.startswith("slipbench")]
    return "\n".join([report.longreprtext, *sections])

"""One HTML page on a run: requirements, measurements, and signal plots around each failure."""

from collections.abc import Iterable
from datetime import UTC, datetime
from html import escape
from importlib.resources import files

from slipbench.bench.testing.plot_svg import plot_svg
from slipbench.bench.testing.summary import TestResult, requirement_verdicts

PAGE = "page.html"


def page(results: list[TestResult], options: str) -> str:
    """Text of the page; it needs no other file. options: the command line of the run."""
    template = files(__package__).joinpath(PAGE).read_text(encoding="utf-8")
    failed = [result for result in results if result.outcome == "failed"]
    parts = {
        "{{when}}": f"{datetime.now(UTC):%Y-%m-%d %H:%M UTC}",
        "{{options}}": escape(options or "pytest"),
        "{{counts}}": _counts(results),
        "{{requirements}}": _requirements(results),
        "{{measurements}}": _measurements(results),
        "{{failures}}": "".join(map(_failure, failed)) or "<p>No test failed.</p>",
    }
    for name, text in parts.items():
        template = template.replace(name, text)
    return template


def _counts(results: list[TestResult]) -> str:
    words = ("passed", "failed", "skipped")
    counts = {word: sum(result.outcome == word for result in results) for word in words}
    tiles = (f'<div class="tile {word}"><b>{counts[word]}</b> {word}</div>' for word in words)
    return "".join(tiles)


def _requirements(results: list[TestResult]) -> str:
    verdicts = requirement_verdicts(results)
    if not verdicts:
        return "<p>No test names a requirement.</p>"
    rows = (
        (escape(name), _badge(verdict), "<br>".join(escape(_short(test)) for test in tests))
        for name, (verdict, tests) in verdicts.items()
    )
    return _table(("requirement", "verdict", "tests"), rows)


def _measurements(results: list[TestResult]) -> str:
    rows = [
        (
            escape(each.name),
            f'<span class="number">{escape(each.shown)}</span>',
            escape(each.limits or "none"),
            _badge(each.verdict),
            escape(each.requirement),
            escape(each.source),
            escape(_short(result.name)),
        )
        for result in results
        for each in result.measurements
    ]
    if not rows:
        return "<p>No test measured anything.</p>"
    head = ("measurement", "value", "limits", "verdict", "requirement", "source", "test")
    return _table(head, rows)


def _failure(result: TestResult) -> str:
    drawings = "".join(plot_svg(plot) for plot in result.plots)
    return (
        f"<section><h3>{escape(_short(result.name))}</h3>"
        f"<pre>{escape(result.text)}</pre>{drawings}</section>"
    )


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    titles = "".join(f"<th>{text}</th>" for text in head)
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><thead><tr>{titles}</tr></thead><tbody>{body}</tbody></table>"


def _badge(verdict: str) -> str:
    return f'<span class="badge {verdict.replace(" ", "-")}">{verdict}</span>'


def _short(name: str) -> str:
    """Name of a test without the folder of its file."""
    return name.rpartition("/")[2]

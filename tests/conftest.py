"""What pytest itself is told about these tests; fixtures live beside those who use them."""

import os

import hypothesis
import pytest

from tests import recordings

# How long an example takes depends on the machine; no test judges it.
hypothesis.settings.register_profile("slipbench", deadline=None)
# Mutants: the same examples for each of them, few, since every mutant runs them, and no shrinking.
hypothesis.settings.register_profile(
    "mutants",
    deadline=None,
    derandomize=True,
    database=None,
    max_examples=25,
    phases=[hypothesis.Phase.explicit, hypothesis.Phase.generate],
)
# The judgement of a commit: the same examples each time, half as many as usual. New ones are drawn
# wherever else tests run.
hypothesis.settings.register_profile("repeatable", deadline=None, derandomize=True, max_examples=50)
hypothesis.settings.load_profile(os.environ.get("SLIPBENCH_HYPOTHESIS", "slipbench"))


def pytest_report_header() -> str:
    """Say whether the tests on real recordings run."""
    return recordings.told()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say what ran on a real CAN interface: those tests are counted by an inner pytest."""
    lines = [
        value
        for outcome in ("passed", "failed")
        for report in terminalreporter.getreports(outcome)
        for name, value in report.user_properties
        if name == "inside"
    ]
    if lines:
        terminalreporter.section("SocketCAN")
        for line in sorted(map(str, lines)):
            terminalreporter.line(line)

"""What pytest itself is told about these tests; fixtures live beside those who use them."""

import os
import subprocess
import sys

import hypothesis
import pytest

from tests import recordings
from tests.paths import ROOT

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
hypothesis.settings.load_profile(os.environ.get("SLIPBENCH_HYPOTHESIS", "slipbench"))


@pytest.hookimpl(tryfirst=True)
def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile the kernel of the plant once, before workers that would each compile it."""
    parallel = getattr(session.config.option, "numprocesses", None)
    if parallel and not hasattr(session.config, "workerinput"):
        code = (
            "from slipbench.plant.simulation import Simulation\n"
            "from slipbench.plant.vehicle_file import load_vehicle\n"
            "from tests.paths import DEMONSTRATION\n"
            "Simulation(load_vehicle(DEMONSTRATION).motorcycle)\n"
        )
        subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


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

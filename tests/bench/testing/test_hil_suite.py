"""The example suite passes on our device, and fails on each broken one on the right requirement."""

import re

import pytest

from tests.bench.testing.conftest import plugin_options
from tests.paths import ROOT

pytest_plugins = ["pytester"]

SUITE = ROOT / "examples" / "hil_tests"
REQUIREMENTS = {*(f"SAF-{number}" for number in range(1, 11)), "AVL-1"}


@pytest.fixture
def verdicts(run, pytester: pytest.Pytester):
    """Run the suite on a device; gives the verdict on each requirement."""

    def of(device: str) -> dict[str, str]:
        options = ("-p", "no:cacheprovider", "-o", "addopts=", "--slipbench-device", device)
        result = pytester.runpytest_inprocess(*plugin_options(), *options, SUITE)
        found = (
            re.fullmatch(r"([A-Z]+-\d+): ([\w ]+) \(\d+ tests?\)", each) for each in result.outlines
        )
        return {match[1]: match[2] for match in found if match}

    return of


def test_the_virtual_motorcycle_meets_every_requirement(verdicts) -> None:
    assert verdicts("virtual") == dict.fromkeys(REQUIREMENTS, "passed")


@pytest.mark.parametrize(
    ("fault", "failed", "not_tested"),
    [
        # without a watchdog nothing that a watchdog ends is ended, and its latch cannot be tested
        ("watchdog_off", {"SAF-3", "SAF-5", "SAF-6"}, {"SAF-4"}),
        ("counter_stuck", {"SAF-7"}, set()),
        ("grant_without_release", {"SAF-4"}, set()),
    ],
)
def test_a_broken_device_fails_on_its_requirement_and_on_no_other(
    verdicts, fault: str, failed: set[str], not_tested: set[str]
) -> None:
    found = verdicts(f"broken_devices:{fault}")
    assert {name for name, verdict in found.items() if verdict == "failed"} == failed
    assert {name for name, verdict in found.items() if verdict == "not tested"} == not_tested
    assert found.keys() == REQUIREMENTS

"""Laws of fault injection: the rider has the throttle in time, record and reason remain."""

import math
from functools import cache
from pathlib import Path

import pytest

from slipbench.protocol.codec.messages import TripReason
from tests.faults.cases import CASES
from tests.faults.matrix import INSIDE, PAGE, content, in_order, page
from tests.faults.run_case import AMPLITUDE, Case, CaseResult, run_case
from tests.paths import ROOT

RESOLUTION = 1e-4  # of a throttle on the wire
A_CYCLE = 0.0025  # s: a tick's release, its frame, and the devices' own millisecond


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory):
    @cache
    def cached(case: Case) -> CaseResult:
        return run_case(case, tmp_path_factory.mktemp("faults") / "run")

    return cached


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_rider_has_the_throttle_in_time_and_the_record_says_why(case: Case, results) -> None:
    result: CaseResult = results(case)
    assert result.truth.deviation <= AMPLITUDE + RESOLUTION
    assert result.reason == case.reason
    assert in_order(result)
    assert result.recording.frame_count > 2000
    if result.outcome is not None and case.reason == TripReason.NONE:
        assert result.outcome.done
        assert case.why, "a fault that ends nothing needs a reason"
        return
    assert result.back <= case.within
    assert case.within <= 0.0215 or case.why


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_after_a_trip_the_devices_hold_nothing_within_a_cycle_or_had_taken_it_back(
    case: Case, results
) -> None:
    """A release needs a working bus; without one, the devices' watchdog of 20 ms counts."""
    result: CaseResult = results(case)
    if math.isnan(result.tripped):
        return
    unheard = {"bench off the bus", "motorcycle off the bus"}
    assert result.back <= result.tripped + A_CYCLE or case.name in unheard


def test_the_page_says_what_happens(results) -> None:
    made = page({case.name: results(case) for case in CASES})
    assert content(PAGE.read_text(encoding="utf-8")) == content(made), "run: make faults"


@pytest.mark.parametrize("case", [c for c in CASES if c.vcan], ids=lambda case: case.name)
def test_a_test_that_a_row_names_exists(case: Case) -> None:
    file, _, name = case.vcan.partition("::")
    assert f"def {name}(" in (ROOT / INSIDE / file).read_text(encoding="utf-8")


def test_names_are_unique() -> None:
    names = [case.name for case in CASES]
    assert len(set(names)) == len(names)
    assert Path(PAGE).exists()

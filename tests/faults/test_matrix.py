"""Laws of everything that goes wrong: the rider has the throttle, the record stays, it is told."""

import math
from functools import cache
from pathlib import Path

import pytest

from slipbench.protocol.codec.messages import TripReason
from tests.faults.cases import CASES
from tests.faults.matrix import INSIDE, PAGE, content, in_order, page
from tests.faults.ride import AMPLITUDE, Case, Ridden, ride
from tests.paths import ROOT

RESOLUTION = 1e-4  # of a throttle on the wire
A_CYCLE = 0.0025  # s: a tick's release, its frame, and the devices' own millisecond


@pytest.fixture(scope="module")
def riding(tmp_path_factory: pytest.TempPathFactory):
    @cache
    def ridden(case: Case) -> Ridden:
        return ride(case, tmp_path_factory.mktemp("faults") / "run")

    return ridden


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_rider_has_the_throttle_in_time_and_the_record_says_why(case: Case, riding) -> None:
    ridden: Ridden = riding(case)
    assert ridden.witness.off_hand <= AMPLITUDE + RESOLUTION
    assert ridden.reason == case.reason
    assert in_order(ridden)
    assert ridden.recording.frame_count > 2000
    if ridden.outcome is not None and case.reason == TripReason.NONE:
        assert ridden.outcome.done
        assert case.why, "a fault that ends nothing needs a reason"
        return
    assert ridden.back <= case.within
    assert case.within <= 0.0215 or case.why


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_after_a_trip_the_devices_hold_nothing_within_a_cycle_or_had_taken_it_back(
    case: Case, riding
) -> None:
    """A release needs a bus: where there is none, the devices' own 20 ms count from the fault."""
    ridden: Ridden = riding(case)
    if math.isnan(ridden.tripped):
        return
    unheard = {"bench off the bus", "motorcycle off the bus"}
    assert ridden.back <= ridden.tripped + A_CYCLE or case.name in unheard


def test_the_page_says_what_happens(riding) -> None:
    made = page({case.name: riding(case) for case in CASES})
    assert content(PAGE.read_text(encoding="utf-8")) == content(made), "run: make faults"


@pytest.mark.parametrize("case", [c for c in CASES if c.vcan], ids=lambda case: case.name)
def test_a_test_that_a_row_names_exists(case: Case) -> None:
    file, _, name = case.vcan.partition("::")
    assert f"def {name}(" in (ROOT / INSIDE / file).read_text(encoding="utf-8")


def test_names_are_unique() -> None:
    names = [case.name for case in CASES]
    assert len(set(names)) == len(names)
    assert Path(PAGE).exists()

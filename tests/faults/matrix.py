"""`python -m tests.faults.matrix` rides every case and writes docs/fault_matrix.md."""

import math
import re
import tempfile
from collections import Counter
from pathlib import Path

from slipbench.protocol.codec.messages import Phase, TripReason
from tests.faults.cases import BENCH, BUS, DEVICES
from tests.faults.ride import Case, Ridden, ride
from tests.paths import ROOT

PAGE = ROOT / "docs" / "fault_matrix.md"
INSIDE = "tests/socketcan/inside"

TEMPLATE = Path(__file__).with_name("page.md")
INTERFACE = "test_an_interface_that_goes_down_ends_both_programs_with_a_word_about_it"
CLOCK = "test_a_clock_that_is_set_moves_neither_the_throttle_nor_the_record"


def main() -> None:
    """Ride, and write."""
    with tempfile.TemporaryDirectory() as folder:
        rides = {
            case.name: ride(case, Path(folder) / case.name.replace(" ", "_"))
            for case in (*BUS, *DEVICES, *BENCH)
        }
    PAGE.write_text(page(rides), encoding="utf-8")


def page(rides: dict[str, Ridden]) -> str:
    """The whole page."""
    tables = {
        name: "\n".join([*table_head(), *(row(case, rides[case.name]) for case in cases)])
        for name, cases in (("bus", BUS), ("devices", DEVICES), ("bench", BENCH))
    }
    down, clock = (words(f"test_faults.py::{test}") for test in (INTERFACE, CLOCK))
    text = TEMPLATE.read_text(encoding="utf-8")
    return text.format(inside=INSIDE, down=down, clock=clock, **tables)


def table_head() -> list[str]:
    names = ("what goes wrong", "the trial", "back, ms", "off, %", "recorded", "told", "vcan0")
    return [f"| {' | '.join(names)} |", "|" + "---|" * len(names)]


def row(case: Case, ridden: Ridden) -> str:
    """One line of the table, from what was measured."""
    goes_on = ridden.outcome is not None and ridden.outcome.done
    ended = "is done" if goes_on else f"trips: {ridden.reason.name.lower()}"
    if ridden.outcome is None:
        ended = "is gone"
    why = f"; {case.why}" if case.why else ""
    told = case.told or (ridden.outcome.trip if ridden.outcome else "")
    cells = (
        case.what,
        ended + why,
        "" if goes_on else f"{ridden.back * 1e3:.0f}",
        f"{ridden.witness.off_hand:.2%}"[:-1],
        recorded(ridden),
        told,
        words(case.vcan),
    )
    return f"| {' | '.join(cells)} |"


def recorded(ridden: Ridden) -> str:
    """Frames, and by kind how many messages had a fault."""
    kinds = Counter(fault.fault for fault in ridden.recording.faults)
    found = [f"{kind} ({count} messages)" for kind, count in sorted(kinds.items())]
    if ridden.error_frames:
        found.append(f"{ridden.error_frames} error frames")
    return "; ".join([f"{ridden.recording.frame_count} frames", *found])


def words(test: str) -> str:
    """A test's name in words, after its file's."""
    file, _, name = test.partition("::")
    return f"`{INSIDE}/{file}`: {name.removeprefix('test_').replace('_', ' ')}" if test else ""


def content(text: str) -> str:
    """What a page says, its figures left out."""
    return re.sub(r"\d+(\.\d+)?", "#", text)


def in_order(ridden: Ridden) -> bool:
    """Tell whether the record of a trial that ended early has it as such."""
    told = ridden.recording.description.get("outcome", {})
    if ridden.outcome is None:
        return told == {}
    state = ridden.outcome.state
    reason = state.trip.reason if state.trip else TripReason.NONE
    return bool(
        told["trip"] == reason.name.lower()
        and told["detail"] == ridden.outcome.trip
        and (state.phase == Phase.DONE or not math.isnan(ridden.tripped))
    )


if __name__ == "__main__":
    main()

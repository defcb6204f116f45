"""`python -m tests.faults.matrix` runs every case and writes docs/fault_matrix.md."""

import math
import re
import tempfile
from collections import Counter
from pathlib import Path

from slipbench.protocol.codec.messages import Phase, TripReason
from tests.faults.cases import BENCH, BUS, DEVICES
from tests.faults.run_case import Case, CaseResult, run_case
from tests.paths import ROOT

PAGE = ROOT / "docs" / "fault_matrix.md"
INSIDE = "tests/socketcan/inside"

TEMPLATE = Path(__file__).with_name("page.md")
INTERFACE = "test_an_interface_that_goes_down_ends_both_programs_with_a_word_about_it"
CLOCK = "test_a_clock_that_is_set_moves_neither_the_throttle_nor_the_record"


def main() -> None:
    """Run every case and write the page."""
    with tempfile.TemporaryDirectory() as folder:
        results = {
            case.name: run_case(case, Path(folder) / case.name.replace(" ", "_"))
            for case in (*BUS, *DEVICES, *BENCH)
        }
    PAGE.write_text(page(results), encoding="utf-8")


def page(results: dict[str, CaseResult]) -> str:
    """Text of the page."""
    tables = {
        name: "\n".join([*table_head(), *(row(case, results[case.name]) for case in cases)])
        for name, cases in (("bus", BUS), ("devices", DEVICES), ("bench", BENCH))
    }
    down, clock = (words(f"test_faults.py::{test}") for test in (INTERFACE, CLOCK))
    text = TEMPLATE.read_text(encoding="utf-8")
    return text.format(inside=INSIDE, down=down, clock=clock, **tables)


def table_head() -> list[str]:
    names = ("fault", "trial", "return, ms", "deviation, %", "recorded", "message", "vcan0")
    return [f"| {' | '.join(names)} |", "|" + "---|" * len(names)]


def row(case: Case, result: CaseResult) -> str:
    """One row of the table, with the measured figures."""
    goes_on = result.outcome is not None and result.outcome.done
    ended = "completes" if goes_on else f"trips: {result.reason.name.lower()}"
    if result.outcome is None:
        ended = "ends: its process is killed"
    why = f"; {case.why}" if case.why else ""
    message = case.message or (result.outcome.trip if result.outcome else "")
    cells = (
        case.what,
        ended + why,
        "" if goes_on else f"{result.back * 1e3:.0f}",
        f"{result.truth.deviation:.2%}"[:-1],
        recorded(result),
        message,
        words(case.vcan),
    )
    return f"| {' | '.join(cells)} |"


def recorded(result: CaseResult) -> str:
    """Number of frames, and for each kind of fault the number of messages that had it."""
    kinds = Counter(fault.fault for fault in result.recording.faults)
    found = [f"{kind} ({count} messages)" for kind, count in sorted(kinds.items())]
    if result.error_frames:
        found.append(f"{result.error_frames} error frames")
    return "; ".join([f"{result.recording.frame_count} frames", *found])


def words(test: str) -> str:
    """A test's name in words, after its file's."""
    file, _, name = test.partition("::")
    return f"`{INSIDE}/{file}`: {name.removeprefix('test_').replace('_', ' ')}" if test else ""


def content(text: str) -> str:
    """Text of a page without its figures."""
    return re.sub(r"\d+(\.\d+)?", "#", text)


def in_order(result: CaseResult) -> bool:
    """Whether run.toml has the outcome of the trial; none where the command was killed."""
    described = result.recording.description.get("outcome", {})
    if result.outcome is None:
        return described == {}
    state = result.outcome.state
    reason = state.trip.reason if state.trip else TripReason.NONE
    return bool(
        described["trip"] == reason.name.lower()
        and described["detail"] == result.outcome.trip
        and (state.phase == Phase.DONE or not math.isnan(result.tripped))
    )


if __name__ == "__main__":
    main()

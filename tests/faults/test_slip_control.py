"""Sensors fail while a slip controller has authority: the throttle does not follow wrong values.

The controller acts on its slip and may move the throttle at up to 540 %/s. The law: between the fault
and the return of authority, the throttle moves no further than in the same time before the fault.
The safety gate ensures this, as it trips in the tick of the first wrong frame. Where a sensor falls
silent, the controller has the last known slip.
"""

from functools import cache, lru_cache, partial
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

from slipbench import dbc
from slipbench.bench.loop.clock import SECOND
from slipbench.bench.trials.preparation import Prepared, prepare
from slipbench.bench.trials.simulated_trial import START
from slipbench.protocol.codec.messages import Authority, TripReason
from tests.bench.trials.test_whole_trial import commands
from tests.faults.cases import CASES
from tests.faults.devices import Silent, Slowing
from tests.faults.run_case import Case, CaseResult, run_case
from tests.paths import TRIALS, with_full_paths

LATE = 2.4  # s in the trial: the tooth pitches are learnt, the controller has been active for 0.5 s
NAMES = (
    "optical drops out",
    "optical silent",
    "counter of OpticalSpeed",
    "optical stuck",
    "rear tooth missing",
    "counter of EngineStatus",
)
HALF_RANGE = 0.054  # of the controller, 0..1
FASTEST = 5.4  # of the controller, 1/s
FRAME, TICK = 0.005, 0.001  # s: longest period of the encoder frames; period of the controller
SHORTER = {
    'duration = "8 s"': 'duration = "1 s"',
    'after = "5 s"': 'after = "1.8 s"',
    'steady_for = "500 ms"': 'steady_for = "100 ms"',
}
OURS = (
    Case(
        "rear encoder silent",
        "the rear encoder says nothing",
        TripReason.STALE,
        failing=partial(Silent, frozenset({"RearTeeth"})),
    ),
    Case(
        "wheel lock",
        "rear wheel stops within 0.1 s",
        TripReason.SLIP,
        teeth=lambda: {"rear": Slowing(10.0, began=LATE)},
    ),
)
FAULTS = [*(case for case in CASES if case.name in NAMES), *OURS]
LOCK = OURS[-1]


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("slip_faults")

    @lru_cache(1)
    def trial() -> Prepared:
        return prepare(_shortened(folder), dbc.MOTORBIKE)

    @cache
    def cached(case: Case) -> CaseResult:
        with (
            mock.patch("tests.faults.devices.AT", LATE),
            mock.patch("tests.faults.run_case.AT", LATE),
        ):
            return run_case(case, folder / case.name.replace(" ", "_"), trial)

    return cached


def _shortened(folder: Path) -> Path:
    text = (TRIALS / "slip_steps_throttle.toml").read_text(encoding="utf-8")
    for old, new in SHORTER.items():
        assert old in text
        text = text.replace(old, new)
    text = with_full_paths(text)
    text = text.replace("\n[", '\nsettling = "100 ms"\nhand_back = "100 ms"\n\n[', 1)
    path = folder / "slip.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("case", FAULTS, ids=lambda case: case.name)
def test_the_rider_has_the_throttle_in_time(case: Case, results) -> None:
    result: CaseResult = results(case)
    either = {case.reason, TripReason.STALE} if case.reason == TripReason.FAULTY else {case.reason}
    assert result.reason in either  # so many frames in a row, or so long: what comes first
    assert result.truth.deviation <= HALF_RANGE + 1e-4
    if case.reason == TripReason.NONE:
        assert result.outcome is not None
        assert result.outcome.done
    else:
        assert result.back <= case.within


@pytest.mark.parametrize("case", [c for c in FAULTS if c != LOCK], ids=lambda case: case.name)
def test_the_throttle_does_not_follow_what_is_untrue(case: Case, results) -> None:
    """Movement until the return of authority, against that in the same time before the fault."""
    before, after = moved(results(case))
    print(f"{case.name}: {before:.2%} in the 20 ms before, {after:.2%} in those after")
    assert after <= before


def test_a_wheel_that_seizes_moves_the_throttle_for_one_frame(results) -> None:
    """The first frame reports a falling slip, and the controller opens the throttle as it should.
    The second frame reports a slip that a driven wheel cannot have.
    """
    time, throttle, fault = sent(results(LOCK))
    _, after = moved(results(LOCK))
    print(f"{after:.2%} in all")
    known = fault + 2 * FRAME + 3 * TICK  # two frames, each on its way and until the next tick
    assert _way(throttle[time >= known]) == 0.0
    assert after <= FASTEST * (FRAME + TICK)


def sent(result: CaseResult) -> tuple[np.ndarray, np.ndarray, float]:
    """Time (s) and throttle of every command with authority, and time of the fault (s)."""
    sent_commands = [
        (t, c) for t, c in commands(result.recording.folder) if c.authority != Authority.NONE
    ]
    time, throttle = np.array([(t, c.throttle) for t, c in sent_commands]).T
    return time, throttle, START / SECOND + result.began


def moved(result: CaseResult, span: float = 0.0215) -> tuple[float, float]:
    """Largest movement of the commanded throttle within `span` s before the fault, and after it."""
    time, throttle, fault = sent(result)
    ends = np.arange(time[0] + span, fault, span)
    ways = [_way(throttle[(time > e - span) & (time <= e)]) for e in ends]
    return max(ways), _way(throttle[(time > fault - 0.001) & (time <= fault + span)])


def _way(values: np.ndarray) -> float:
    return float(np.ptp(values)) if values.size else 0.0

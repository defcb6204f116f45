"""Sensors fail while a slip controller has authority: the throttle does not follow what is untrue.

The controller believes its slip, and what it believes moves the throttle at up to 540 %/s. So what
counts is how far the throttle was moved between the fault and its being the rider's again: no more
than in as long before the fault. The gate sees to it, which trips in the very tick of the first
untrue frame; where a sensor falls silent, the slip that was last known is what the controller has.
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
from tests.faults.ride import Case, Ridden, ride
from tests.paths import TRIALS, with_full_paths

LATE = 2.4  # s into the trial: the teeth are learnt, and the controller has held for half a second
NAMES = (
    "optical drops out",
    "optical silent",
    "counter of OpticalSpeed",
    "optical stuck",
    "rear tooth missing",
    "counter of EngineStatus",
)
REACH = 0.054  # of the controller, 0..1
FASTEST = 5.4  # of the controller, 1/s
FRAME, TICK = 0.005, 0.001  # s: an encoder waits no longer before it tells; the controller's step
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
def riding(tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("slip_faults")

    @lru_cache(1)
    def trial() -> Prepared:
        return prepare(_shortened(folder), dbc.MOTORBIKE)

    @cache
    def ridden(case: Case) -> Ridden:
        with mock.patch("tests.faults.devices.AT", LATE), mock.patch("tests.faults.ride.AT", LATE):
            return ride(case, folder / case.name.replace(" ", "_"), trial)

    return ridden


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
def test_the_rider_has_the_throttle_in_time(case: Case, riding) -> None:
    ridden: Ridden = riding(case)
    either = {case.reason, TripReason.STALE} if case.reason == TripReason.FAULTY else {case.reason}
    assert ridden.reason in either  # so many frames in a row, or so long: what comes first
    assert ridden.witness.off_hand <= REACH + 1e-4
    if case.reason == TripReason.NONE:
        assert ridden.outcome is not None
        assert ridden.outcome.done
    else:
        assert ridden.back <= case.within


@pytest.mark.parametrize("case", [c for c in FAULTS if c != LOCK], ids=lambda case: case.name)
def test_the_throttle_does_not_follow_what_is_untrue(case: Case, riding) -> None:
    """What it moved until it was the rider's, against what it moved in as long before the fault."""
    before, after = moved(riding(case))
    print(f"{case.name}: {before:.2%} in the 20 ms before, {after:.2%} in those after")
    assert after <= before


def test_a_wheel_that_seizes_is_believed_for_one_frame(riding) -> None:
    """The first frame of it tells of a slip that falls, and to answer that is what the controller
    is for: it opens as quickly as it may. The second one tells of a slip that no drive makes.
    """
    time, throttle, fault = sent(riding(LOCK))
    _, after = moved(riding(LOCK))
    print(f"{after:.2%} in all")
    known = fault + 2 * FRAME + 3 * TICK  # two frames, each on its way and until the next tick
    assert _way(throttle[time >= known]) == 0.0
    assert after <= FASTEST * (FRAME + TICK)


def sent(ridden: Ridden) -> tuple[np.ndarray, np.ndarray, float]:
    """Give time (s) and throttle of every command with authority, and when the fault began (s)."""
    told = [(t, c) for t, c in commands(ridden.recording.folder) if c.authority != Authority.NONE]
    time, throttle = np.array([(t, c.throttle) for t, c in told]).T
    return time, throttle, START / SECOND + ridden.began


def moved(ridden: Ridden, span: float = 0.0215) -> tuple[float, float]:
    """Furthest way of the commanded throttle in windows of `span` s before the fault, and after."""
    time, throttle, fault = sent(ridden)
    ends = np.arange(time[0] + span, fault, span)
    ways = [_way(throttle[(time > e - span) & (time <= e)]) for e in ends]
    return max(ways), _way(throttle[(time > fault - 0.001) & (time <= fault + span)])


def _way(values: np.ndarray) -> float:
    return float(np.ptp(values)) if values.size else 0.0

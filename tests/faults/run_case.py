"""One trial on the bus model and the simulated clock, with one fault injected."""

from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, field
from functools import lru_cache, partial
from pathlib import Path
from unittest import mock

from slipbench.bench.bus.faults import Fault, FaultPlan
from slipbench.bench.loop.clock import SECOND
from slipbench.bench.trials.outcome import Outcome
from slipbench.bench.trials.preparation import Prepared
from slipbench.bench.trials.run import run_trial
from slipbench.bench.trials.simulated_trial import START, simulated_trial
from slipbench.protocol.codec.messages import Phase, TripReason
from slipbench.protocol.logs import read_log
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.run_folder import FRAMES, read
from tests.bench.trials.test_whole_trial import prepared
from tests.faults.devices import AT, Failing, FailingMotorcycle, GroundTruth, Teeth, no_fault
from tests.faults.ending import Killed, nothing

AMPLITUDE = 0.02  # of the excitation, 0..1
SHORT = {
    "excitation__duration": "1 s",
    "excitation__start": "2 Hz",
    "operating_point__steady_for": "100 ms",
    "settling": "100 ms",
    "hand_back": "100 ms",
}


@dataclass(frozen=True)
class Case:
    """One fault, injected at `AT`; faults of the bus state their own times.

    what     description for the table
    reason   trip reason; NONE: the trial completes
    within   s, longest time from the fault until the rider has the throttle
    why      reason where that exceeds 20 ms and a cycle of the devices, or the trial completes
    message  message to the user where the trial itself was killed
    vcan     test that does the same to real processes on vcan0, in tests/socketcan/inside
    """

    name: str
    what: str
    reason: TripReason
    bus: tuple[Fault, ...] = ()
    failing: Callable[[], Failing] = lambda: no_fault
    teeth: Callable[[], dict[str, Teeth]] = dict
    bench: Callable[[GroundTruth], AbstractContextManager[None]] = nothing
    within: float = 0.0215
    why: str = ""
    message: str = ""
    vcan: str = ""


@dataclass(frozen=True)
class CaseResult:
    """Result of a case; times in s from the fault, NaN where the event did not occur.

    began    s in the trial, time of the first message or tooth that the fault changed
    tripped  time of the trip
    back     time from which the devices grant the bench nothing
    """

    outcome: Outcome | None
    truth: GroundTruth
    recording: Recording
    error_frames: int
    began: float = AT
    tripped: float = field(default=float("nan"))

    @property
    def reason(self) -> TripReason:
        trip = self.outcome.state.trip if self.outcome else None
        return trip.reason if trip else TripReason.NONE

    @property
    def back(self) -> float:
        return self.truth.held + 1e-3 - self.began


@lru_cache(1)
def the_trial() -> Prepared:
    """A short throttle sweep: the bench holds authority from 0.23 s to 1.43 s."""
    return prepared(**SHORT)


def run_case(case: Case, folder: Path, trial: Callable[[], Prepared] = the_trial) -> CaseResult:
    """Run a trial with the fault of a case, recorded into the new `folder`."""
    truth = GroundTruth()
    teeth = case.teeth()
    motorcycle = partial(FailingMotorcycle.with_faults, truth, case.failing(), teeth)
    simulated = partial(simulated_trial, faults=FaultPlan(case.bus, seed=1))
    outcome = None
    with (
        mock.patch("slipbench.bench.trials.simulated_trial.VirtualMotorcycle", motorcycle),
        mock.patch("slipbench.bench.trials.run.simulated_trial", simulated),
        case.bench(truth),
        suppress(Killed),  # only the files on the disk remain
    ):
        outcome = run_trial(trial(), folder, None)
    errors = read_log(folder / FRAMES).frames.skipped
    began = min((each.began for each in teeth.values()), default=AT)
    return CaseResult(
        outcome,
        truth,
        read(folder),
        dict(errors).get("error frames", 0),
        began,
        _tripped(outcome, began),
    )


def _tripped(outcome: Outcome | None, began: float) -> float:
    times = [c.time_ns for c in outcome.changes if c.phase == Phase.TRIPPED] if outcome else []
    return (times[0] - START) / SECOND - began if times else float("nan")

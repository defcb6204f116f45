"""One trial on the faithful bus and the simulated clock, to which one thing is done."""

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
from tests.faults.devices import AT, Failing, FailingMotorcycle, Teeth, Witness, sound
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
    """One thing that goes wrong at `AT`, or (bus faults of another time) whenever they say.

    what     in words, for the table
    reason   why the trial ends; NONE: it goes on to its end
    within   s from the fault until the rider has the throttle, at most
    why      where that is more than 20 ms and a cycle of the devices, or nothing notices: why
    told     what the user is told where the trial itself cannot tell any more
    vcan     the test that does the same to real programs on vcan0, in tests/socketcan/inside
    """

    name: str
    what: str
    reason: TripReason
    bus: tuple[Fault, ...] = ()
    failing: Callable[[], Failing] = lambda: sound
    teeth: Callable[[], dict[str, Teeth]] = dict
    bench: Callable[[Witness], AbstractContextManager[None]] = nothing
    within: float = 0.0215
    why: str = ""
    told: str = ""
    vcan: str = ""


@dataclass(frozen=True)
class Ridden:
    """What became of it; times in s from the fault, NaN where it did not come to that.

    began          s into the trial, when the fault first showed in anything that was sent
    tripped, back  when the bench tripped, and when the devices held nothing for it any more
    """

    outcome: Outcome | None
    witness: Witness
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
        return self.witness.held + 1e-3 - self.began


@lru_cache(1)
def the_trial() -> Prepared:
    """A short throttle sweep: the bench holds authority from 0.23 s to 1.43 s."""
    return prepared(**SHORT)


def ride(case: Case, folder: Path, trial: Callable[[], Prepared] = the_trial) -> Ridden:
    """Ride a trial with what goes wrong in a case, recorded into the new `folder`."""
    witness = Witness()
    teeth = case.teeth()
    motorcycle = partial(FailingMotorcycle.with_faults, witness, case.failing(), teeth)
    simulated = partial(simulated_trial, faults=FaultPlan(case.bus, seed=1))
    outcome = None
    with (
        mock.patch("slipbench.bench.trials.simulated_trial.VirtualMotorcycle", motorcycle),
        mock.patch("slipbench.bench.trials.run.simulated_trial", simulated),
        case.bench(witness),
        suppress(Killed),  # what is left then is on the disk
    ):
        outcome = run_trial(trial(), folder, None)
    errors = read_log(folder / FRAMES).frames.skipped
    began = min((each.began for each in teeth.values()), default=AT)
    return Ridden(
        outcome,
        witness,
        read(folder),
        dict(errors).get("error frames", 0),
        began,
        _tripped(outcome, began),
    )


def _tripped(outcome: Outcome | None, began: float) -> float:
    times = [c.time_ns for c in outcome.changes if c.phase == Phase.TRIPPED] if outcome else []
    return (times[0] - START) / SECOND - began if times else float("nan")

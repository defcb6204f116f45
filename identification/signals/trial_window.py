"""When a trial excited the motorcycle, and at which operating point."""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.signals.dataset import Dataset
from slipbench.identification.signals.samples import BoolArray
from slipbench.protocol.codec.messages import Phase, TripReason

SHORTEST = 1.0  # s
MARGIN = 2.0  # s


@dataclass(frozen=True)
class TrialWindow:
    """Part of the time base in which a trial excited.

    exciting  slice of the time base in which the phase was EXCITING
    record    the same with up to 2 s before it and after it, so that the response to what was
              before and the response that still fades are inside
    trip      why it ended early; NONE where it did not
    trip_time s, when; NaN where it did not trip
    """

    exciting: slice
    record: slice
    trip: TripReason
    trip_time: float


@dataclass(frozen=True)
class NoExcitation:
    """Why there is nothing to identify; `roles` name what is missing, if anything is."""

    reason: str
    roles: tuple[str, ...] = ()
    tripped: bool = False


def trial_window(base: Dataset) -> TrialWindow | NoExcitation:
    """Find the longest segment of phase EXCITING."""
    phase = base.get("trial_phase")
    if phase is None:
        return NoExcitation("no trial phase and so no excitation was recorded", ("trial_phase",))
    run = _longest(phase == Phase.EXCITING)
    trip, when = tripped(base)
    if run is None:
        why = f" (tripped at {when:.2f} s: {trip_in_words(trip)})" if trip else ""
        return NoExcitation(f"the trial never came to its excitation{why}", (), bool(trip))
    if (run.stop - run.start) / base.rate < SHORTEST:
        return NoExcitation(
            f"the excitation lasted {(run.stop - run.start) / base.rate:.2f} s, "
            f"at least {SHORTEST:g} s are needed"
        )
    return TrialWindow(run, with_margin(run, base, bool(trip)), trip, when)


def tripped(base: Dataset) -> tuple[TripReason, float]:
    """Time (s) and reason of the trip, if the trial tripped."""
    reason = base.get("trip_reason")
    if reason is None:
        return TripReason.NONE, float("nan")
    at = np.flatnonzero(np.nan_to_num(reason) > 0)
    if not at.size:
        return TripReason.NONE, float("nan")
    code = int(reason[at[0]])
    known = code in {item.value for item in TripReason}
    return TripReason(code) if known else TripReason.STOPPED, float(base.time[at[0]])


def trip_in_words(trip: TripReason) -> str:
    """Return a trip reason in the rider's words."""
    return _WORDS.get(trip.name, trip.name.lower().replace("_", " "))


_WORDS = {
    "BUTTON_RELEASED": "the rider let the button go",
    "BRAKE": "the rider braked",
    "CLUTCH": "the clutch was pulled",
    "GRIP_CLOSED": "the rider closed the grip",
    "GEAR": "the gear changed",
    "ENGINE_SPEED": "the engine speed left its window",
    "SPEED": "the speed left its window",
    "SLIP": "the slip exceeded its limit",
    "DISTANCE": "the straight was used up",
    "STALE": "a status that the safety logic reads fell silent",
    "FAULTY": "frames that the safety logic reads arrived faulty",
    "BUS_OFF": "the bus went off",
    "AMPLITUDE": "a command exceeded the amplitude limit",
    "RATE": "a command exceeded the rate limit",
    "RANGE": "a command would have left the actuator's range",
    "AUTHORITY_LOST": "the ECU took authority back",
    "RECORDER": "the recorder could not write",
    "STOPPED": "the bench was stopped",
    "NEVER_PRESSED": "the button was not pressed in time",
}


def _longest(active: BoolArray) -> slice | None:
    edges = np.flatnonzero(np.diff(np.concatenate(([0], active.astype(int), [0]))))
    if not edges.size:
        return None
    starts, ends = edges[::2], edges[1::2]
    best = int(np.argmax(ends - starts))
    return slice(int(starts[best]), int(ends[best]))


def with_margin(run: slice, base: Dataset, cut: bool = False) -> slice:
    """Segment with up to 2 s to each side; not beyond a trip (`cut`), after which anything may happen."""
    margin = round(MARGIN * base.rate)
    stop = run.stop if cut else min(run.stop + margin, base.time.size)
    return slice(max(run.start - margin, 0), stop)

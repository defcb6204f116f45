"""A trial as a state machine: what phase it is in, and what it asks for, as pure functions.

idle -> armed -> exciting -> settling -> handing back -> done
              any of them -> tripped
"""

import math
from dataclasses import dataclass, replace

from slipbench.bench.safety.permit import CLOCK_RESOLUTION, Trip
from slipbench.bench.safety.vehicle_state import Seen
from slipbench.bench.trials.excitation import Excitation
from slipbench.protocol.codec.messages import ActuatorCommand, Authority, Phase, TripReason
from slipbench.protocol.controller_file import ControllerFile
from slipbench.protocol.trial_file import RPM, TrialFile

HOLDING = frozenset({Phase.EXCITING, Phase.SETTLING, Phase.HANDING_BACK})
ENDED = frozenset({Phase.DONE, Phase.TRIPPED})


AUTHORITY = {"throttle": Authority.THROTTLE, "spark": Authority.SPARK, "mixed": Authority.BOTH}


@dataclass(frozen=True, slots=True)
class Plan:
    """A trial, its waveform computed, the authority that it needs, and the controller's file.

    See `plan_of`. controller: None where the waveform itself is what is commanded.
    """

    trial: TrialFile
    excitation: Excitation
    authority: Authority
    controller: ControllerFile | None = None


def plan_of(
    trial: TrialFile, excitation: Excitation, controller: ControllerFile | None = None
) -> Plan:
    """Ask for authority over what is excited, or what the controller moves, and no more."""
    actuator = controller.actuator if controller else excitation.actuator
    return Plan(trial, excitation, AUTHORITY[actuator], controller)


@dataclass(frozen=True, slots=True)
class Asked:
    """What is asked for beside the operating point: offsets of throttle (0..1) and spark (rad)."""

    throttle: float = 0.0
    spark: float = 0.0


NOTHING = Asked()


@dataclass(frozen=True, slots=True)
class TrialState:
    """Where a trial stands.

    since         s, when the phase began (NaN before the first tick)
    steady_since  s, since when rpm and gear have been inside the window (NaN: they are not)
    released      the button has been seen released since arming
    throttle      operating point: opening when the button was pressed, 0..1
    grip          the rider's grip then, 0..1
    target        opening that the hand-back ramps to: the rider's grip when the ramp began
    left          what a controller asked for when the ramp began
    trip          why the trial ended early
    """

    phase: Phase = Phase.IDLE
    since: float = math.nan
    steady_since: float = math.nan
    released: bool = False
    throttle: float = math.nan
    grip: float = math.nan
    target: float = math.nan
    left: Asked = NOTHING
    trip: Trip | None = None


def advance(
    state: TrialState, seen: Seen, plan: Plan, now: float, standing: Asked = NOTHING
) -> TrialState:
    """Move the trial on by what was seen; `now` in s. Ended trials stay as they are.

    standing: what a controller asked for last.
    """
    if state.phase == Phase.IDLE:
        return _idle(state, seen, plan, now)
    if state.phase == Phase.ARMED:
        return _armed(state, seen, plan, now)
    if state.phase in HOLDING:
        return _holding(state, seen, plan, now, standing)
    return state


def tripped(state: TrialState, trip: Trip, now: float) -> TrialState:
    """End the trial because of `trip`; an ended trial keeps its first reason."""
    return state if state.phase in ENDED else replace(_enter(state, Phase.TRIPPED, now), trip=trip)


def controlling(state: TrialState, plan: Plan) -> bool:
    """Tell whether a controller has the say: from the button until the hand-back begins."""
    return plan.controller is not None and state.phase in (Phase.EXCITING, Phase.SETTLING)


def due(state: TrialState, plan: Plan, now: float) -> float:
    """Say what the waveform adds at `now` (s): to the actuator, or to a controller's target."""
    return plan.excitation.value(now - state.since) if state.phase == Phase.EXCITING else 0.0


def wanted(
    state: TrialState, plan: Plan, now: float, asked: Asked | None = None
) -> ActuatorCommand:
    """Say what the trial asks for at `now`: the operating point plus what is due.

    asked: what a controller asks for, while it has the say.
    """
    if state.phase not in HOLDING:
        return ActuatorCommand(Authority.NONE, 0.0, 0.0, now)
    if asked is None:
        asked = _unaided(state, plan, now)
    throttle = state.throttle + asked.throttle if plan.authority & Authority.THROTTLE else 0.0
    spark = asked.spark if plan.authority & Authority.SPARK else 0.0
    return ActuatorCommand(plan.authority, throttle, spark, now)


def _unaided(state: TrialState, plan: Plan, now: float) -> Asked:
    """Say what is asked for where no controller has the say: the waveform, then the ramp home."""
    if state.phase != Phase.HANDING_BACK:
        offset = due(state, plan, now)
        return Asked(offset, offset)
    share = min((now - state.since) / plan.trial.hand_back, 1.0)
    way = state.target - state.throttle - state.left.throttle
    return Asked(state.left.throttle + share * way, (1.0 - share) * state.left.spark)


def _idle(state: TrialState, seen: Seen, plan: Plan, now: float) -> TrialState:
    if math.isnan(state.since):
        state = replace(state, since=now)
    trouble = unsteady(seen, plan)
    if trouble and now - state.since > plan.trial.ready_within:
        return tripped(state, Trip(TripReason.NEVER_READY, trouble), now)
    if trouble:
        return replace(state, steady_since=math.nan)
    since = now if math.isnan(state.steady_since) else state.steady_since
    if now - since >= plan.trial.operating_point.steady_for:
        return replace(_enter(state, Phase.ARMED, now), released=False)
    return replace(state, steady_since=since)


def _armed(state: TrialState, seen: Seen, plan: Plan, now: float) -> TrialState:
    if unsteady(seen, plan):
        return replace(_enter(state, Phase.IDLE, now), steady_since=math.nan)
    if now - state.since > plan.trial.armed_for_at_most:
        return tripped(state, Trip(TripReason.NEVER_PRESSED, "the button was not pressed"), now)
    if not seen.rider.button:
        return replace(state, released=True)
    return _pressed(state, seen, plan, now) if state.released else state


def _pressed(state: TrialState, seen: Seen, plan: Plan, now: float) -> TrialState:
    """Take the operating point that stands now, if the whole waveform fits around it."""
    low, high = plan.trial.limits.throttle
    table, throttle = plan.excitation.table, seen.ecu.throttle_command
    if plan.excitation.actuator == "throttle" and not (
        low <= throttle + float(table.min()) and throttle + float(table.max()) <= high
    ):
        swing = float(abs(table).max())
        detail = f"{swing:.1%} about {throttle:.1%} would leave {low:.1%} .. {high:.1%}"
        return tripped(state, Trip(TripReason.RANGE, detail), now)
    entered = _enter(state, Phase.EXCITING, now)
    return replace(entered, throttle=throttle, grip=seen.rider.grip)


def _holding(state: TrialState, seen: Seen, plan: Plan, now: float, standing: Asked) -> TrialState:
    """Go on to the next phase when this one's time is up.

    Once the excitation is over the rider may let go: that is a hand-back, not a trip.
    """
    if state.phase != Phase.EXCITING and not seen.rider.button:
        return _enter(state, Phase.DONE, now)
    lasts, then = {
        Phase.EXCITING: (plan.excitation.duration, Phase.SETTLING),
        Phase.SETTLING: (plan.trial.settling, Phase.HANDING_BACK),
        Phase.HANDING_BACK: (plan.trial.hand_back, Phase.DONE),
    }[state.phase]
    if now - state.since < lasts - CLOCK_RESOLUTION:
        return state
    if then == Phase.HANDING_BACK:
        target = _hand_back_target(state, seen, plan)
        state = replace(state, target=target, left=standing)
    return _enter(state, then, now)


def _hand_back_target(state: TrialState, seen: Seen, plan: Plan) -> float:
    """Aim for what the rider's grip asks for, as far as range and deviation allow.

    The aim is taken once: a grip that moves during the ramp must not make the command jump.
    """
    most = plan.trial.limits.throttle_deviation
    low, high = plan.trial.limits.throttle
    inside = min(max(seen.rider.grip, low), high)
    return min(max(inside, state.throttle - most), state.throttle + most)


def unsteady(seen: Seen, plan: Plan) -> str:
    """Say what keeps the bench from arming; empty where nothing does."""
    point, limits = plan.trial.operating_point, plan.trial.limits
    if not 0.0 <= seen.oldest_age <= limits.stale:
        return f"{seen.oldest} is silent"
    if seen.throttle.faulty:
        return "the throttle body reports a fault"
    if seen.ecu.authority != Authority.NONE:
        return f"the ECU grants {seen.ecu.authority.name} that nobody asked for"
    if seen.engine.gear != point.gear:
        return f"gear {seen.engine.gear}, the trial wants {point.gear}"
    if not abs(seen.engine.engine_speed - point.engine_speed) <= point.engine_speed_window:
        wanted_rpm, window = point.engine_speed / RPM, point.engine_speed_window / RPM
        return f"engine at {seen.engine.engine_speed / RPM:.0f} rpm, the trial wants " + (
            f"{wanted_rpm:.0f} +- {window:.0f} rpm"
        )
    return ""


def _enter(state: TrialState, phase: Phase, now: float) -> TrialState:
    return replace(state, phase=phase, since=now)

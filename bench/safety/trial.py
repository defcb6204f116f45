"""A trial as a state machine: its phase and the command that it requests, as pure functions.

idle -> armed -> exciting -> settling -> handing back -> done
              any of them -> tripped
"""

import math
from dataclasses import dataclass, replace

from slipbench.bench.safety.permit import CLOCK_RESOLUTION, Trip
from slipbench.bench.safety.vehicle_state import VehicleState
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
    """Plan of a trial: authority over what is excited or what the controller moves, and no more."""
    actuator = controller.actuator if controller else excitation.actuator
    return Plan(trial, excitation, AUTHORITY[actuator], controller)


@dataclass(frozen=True, slots=True)
class Offsets:
    """Requested offsets from the operating point: throttle (0..1) and spark (rad)."""

    throttle: float = 0.0
    spark: float = 0.0


NO_OFFSETS = Offsets()


@dataclass(frozen=True, slots=True)
class TrialState:
    """State of a trial.

    since         s, when the phase began (NaN before the first tick)
    steady_since  s, since when rpm and gear have been inside the window (NaN: they are not)
    released      the button was released at least once since arming
    throttle      operating point: opening when the button was pressed, 0..1
    grip          the rider's grip then, 0..1
    target        opening that the hand-back ramps to: the rider's grip when the ramp began
    ramp_start    offsets that a controller requested when the ramp began
    trip          why the trial ended early
    """

    phase: Phase = Phase.IDLE
    since: float = math.nan
    steady_since: float = math.nan
    released: bool = False
    throttle: float = math.nan
    grip: float = math.nan
    target: float = math.nan
    ramp_start: Offsets = NO_OFFSETS
    trip: Trip | None = None


def advance(
    state: TrialState,
    vehicle: VehicleState,
    plan: Plan,
    now: float,
    last_offsets: Offsets = NO_OFFSETS,
) -> TrialState:
    """Next state of the trial. now: s. An ended trial keeps its state.

    last_offsets: that a controller requested last.
    """
    if state.phase == Phase.IDLE:
        return _idle(state, vehicle, plan, now)
    if state.phase == Phase.ARMED:
        return _armed(state, vehicle, plan, now)
    if state.phase in HOLDING:
        return _holding(state, vehicle, plan, now, last_offsets)
    return state


def tripped(state: TrialState, trip: Trip, now: float) -> TrialState:
    """State after `trip` at `now` (s); an ended trial keeps its first reason."""
    return state if state.phase in ENDED else replace(_enter(state, Phase.TRIPPED, now), trip=trip)


def controller_active(state: TrialState, plan: Plan) -> bool:
    """Whether a controller sets the command: from the button until the hand-back begins."""
    return plan.controller is not None and state.phase in (Phase.EXCITING, Phase.SETTLING)


def waveform_value(state: TrialState, plan: Plan, now: float) -> float:
    """Value of the waveform at `now` (s), added to the actuator or to a controller's target."""
    return plan.excitation.value(now - state.since) if state.phase == Phase.EXCITING else 0.0


def requested_command(
    state: TrialState, plan: Plan, now: float, requested: Offsets | None = None
) -> ActuatorCommand:
    """Command that the trial requests at `now` (s): operating point plus offsets.

    requested: offsets of the controller, while it sets the command.
    """
    if state.phase not in HOLDING:
        return ActuatorCommand(Authority.NONE, 0.0, 0.0, now)
    if requested is None:
        requested = _without_controller(state, plan, now)
    throttle = state.throttle + requested.throttle if plan.authority & Authority.THROTTLE else 0.0
    spark = requested.spark if plan.authority & Authority.SPARK else 0.0
    return ActuatorCommand(plan.authority, throttle, spark, now)


def _without_controller(state: TrialState, plan: Plan, now: float) -> Offsets:
    """Offsets where no controller sets the command: the waveform, then the hand-back ramp."""
    if state.phase != Phase.HANDING_BACK:
        offset = waveform_value(state, plan, now)
        return Offsets(offset, offset)
    share = min((now - state.since) / plan.trial.hand_back, 1.0)
    distance = state.target - state.throttle - state.ramp_start.throttle
    return Offsets(
        state.ramp_start.throttle + share * distance, (1.0 - share) * state.ramp_start.spark
    )


def _idle(state: TrialState, vehicle: VehicleState, plan: Plan, now: float) -> TrialState:
    if math.isnan(state.since):
        state = replace(state, since=now)
    trouble = not_ready(vehicle, plan)
    if trouble and now - state.since > plan.trial.ready_within:
        return tripped(state, Trip(TripReason.NEVER_READY, trouble), now)
    if trouble:
        return replace(state, steady_since=math.nan)
    since = now if math.isnan(state.steady_since) else state.steady_since
    if now - since >= plan.trial.operating_point.steady_for:
        return replace(_enter(state, Phase.ARMED, now), released=False)
    return replace(state, steady_since=since)


def _armed(state: TrialState, vehicle: VehicleState, plan: Plan, now: float) -> TrialState:
    if not_ready(vehicle, plan):
        return replace(_enter(state, Phase.IDLE, now), steady_since=math.nan)
    if now - state.since > plan.trial.armed_for_at_most:
        return tripped(state, Trip(TripReason.NEVER_PRESSED, "the button was not pressed"), now)
    if not vehicle.rider.button:
        return replace(state, released=True)
    return _pressed(state, vehicle, plan, now) if state.released else state


def _pressed(state: TrialState, vehicle: VehicleState, plan: Plan, now: float) -> TrialState:
    """Take the present operating point, if the whole waveform fits around it."""
    low, high = plan.trial.limits.throttle
    table, throttle = plan.excitation.table, vehicle.ecu.throttle_command
    if plan.excitation.actuator == "throttle" and not (
        low <= throttle + float(table.min()) and throttle + float(table.max()) <= high
    ):
        amplitude = float(abs(table).max())
        detail = f"{amplitude:.1%} about {throttle:.1%} would leave {low:.1%} .. {high:.1%}"
        return tripped(state, Trip(TripReason.RANGE, detail), now)
    entered = _enter(state, Phase.EXCITING, now)
    return replace(entered, throttle=throttle, grip=vehicle.rider.grip)


def _holding(
    state: TrialState, vehicle: VehicleState, plan: Plan, now: float, last_offsets: Offsets
) -> TrialState:
    """Next phase when the time of this one is over.

    Once the excitation is over the rider may let go: that is a hand-back, not a trip.
    """
    if state.phase != Phase.EXCITING and not vehicle.rider.button:
        return _enter(state, Phase.DONE, now)
    lasts, then = {
        Phase.EXCITING: (plan.excitation.duration, Phase.SETTLING),
        Phase.SETTLING: (plan.trial.settling, Phase.HANDING_BACK),
        Phase.HANDING_BACK: (plan.trial.hand_back, Phase.DONE),
    }[state.phase]
    if now - state.since < lasts - CLOCK_RESOLUTION:
        return state
    if then == Phase.HANDING_BACK:
        target = _hand_back_target(state, vehicle, plan)
        state = replace(state, target=target, ramp_start=last_offsets)
    return _enter(state, then, now)


def _hand_back_target(state: TrialState, vehicle: VehicleState, plan: Plan) -> float:
    """Opening of the rider's grip, as far as range and deviation allow.

    It is taken once: a grip that moves during the ramp must not make the command jump.
    """
    limit = plan.trial.limits.throttle_deviation
    low, high = plan.trial.limits.throttle
    inside = min(max(vehicle.rider.grip, low), high)
    return min(max(inside, state.throttle - limit), state.throttle + limit)


def not_ready(vehicle: VehicleState, plan: Plan) -> str:
    """Reason why the bench cannot be armed; empty where there is none."""
    point, limits = plan.trial.operating_point, plan.trial.limits
    if not 0.0 <= vehicle.oldest_age <= limits.stale:
        return f"{vehicle.oldest} is silent"
    if vehicle.throttle.faulty:
        return "the throttle body reports a fault"
    if vehicle.ecu.authority != Authority.NONE:
        return f"the ECU grants {vehicle.ecu.authority.name} without a request"
    if vehicle.engine.gear != point.gear:
        return f"gear {vehicle.engine.gear}, the trial requires {point.gear}"
    if not abs(vehicle.engine.engine_speed - point.engine_speed) <= point.engine_speed_window:
        target_rpm, window = point.engine_speed / RPM, point.engine_speed_window / RPM
        return f"engine at {vehicle.engine.engine_speed / RPM:.0f} rpm, the trial requires " + (
            f"{target_rpm:.0f} +- {window:.0f} rpm"
        )
    return ""


def _enter(state: TrialState, phase: Phase, now: float) -> TrialState:
    return replace(state, phase=phase, since=now)

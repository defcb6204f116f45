"""Degraded modes of a bus: each tightens the limits of a trial, and is written into run and report."""

from collections.abc import Iterator
from dataclasses import dataclass

from slipbench.protocol.binding.binding import Binding
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.errors import InputError
from slipbench.protocol.quantity import Quantity, shown
from slipbench.protocol.trial_file import TrialFile

SLIP_SHARE = 0.75  # of the slip limits: sampled wheel speeds are filtered and late
SPEED_SHARE = 0.75  # of the slip limit: a front wheel that slips too hides as much
BLIND_SHARE = 0.5  # of deviation and rates, while no signal confirms that requests apply
LEAST_SLIP = 0.01  # road noise would exceed a smaller limit


@dataclass(frozen=True)
class Mode:
    """A degraded mode: what the bus lacks, what the bench does, how it tightens the limits."""

    text: str
    shares: tuple[tuple[str, float], ...] = ()


def modes(binding: Binding, codec: Codec, trial: TrialFile) -> Iterator[Mode]:
    """Degraded modes of a binding in a trial."""
    degraded = binding.degraded
    if degraded.wheels is not None:
        period, quantum = _wheel_errors(codec)
        error = quantum / float(trial.limits.speed[0])
        yield Mode(
            f"no tooth times: slip from wheel speeds, up to {period * 1e3:g} ms old,"
            f" quantum {quantum:.3g} m/s (slip error {error:.2%})",
            (("slip", SLIP_SHARE), ("front_slip", SLIP_SHARE)),
        )
    if degraded.speed == "front_wheel":
        yield Mode(
            "no optical speed: slip of the rear wheel against the front wheel; the slip of the front"
            " wheel is not monitored",
            (("slip", SPEED_SHARE),),
        )
    if degraded.speed == "gnss":
        yield Mode("no optical speed: slip against the GNSS speed", (("slip", SPEED_SHARE),))
    if degraded.echo is not None:
        yield Mode(
            f"no echo: requests count as applied after {float(degraded.echo) * 1e3:g} ms",
            (("throttle_deviation", BLIND_SHARE), ("throttle_rate", BLIND_SHARE)),
        )
    if degraded.hand_back is not None:
        yield Mode(
            "no authority signal: the ECU gives the throttle back"
            f" {float(degraded.hand_back) * 1e3:g} ms after the last request",
            (("throttle_deviation", BLIND_SHARE),),
        )
    if degraded.throttle_body is not None:
        yield Mode("the throttle body does not state its authority: taken from the ECU")
    for name in degraded.unmonitored:
        yield Mode(f"not monitored, as no signal gives it: {name}", (("distance", 0.5),))


def degraded_trial(trial: TrialFile, binding: Binding, codec: Codec) -> TrialFile:
    """Trial with the limits that the degraded modes of its bus tighten.

    Raises InputError where a limit becomes too tight, or the ECU hands back later than the trial says.
    """
    _check_times(trial, binding, codec)
    limits = trial.limits
    tightened: dict[str, float] = {}
    for mode in modes(binding, codec, trial):
        for name, share in mode.shares:
            tightened[name] = tightened.get(name, float(getattr(limits, name))) * share
    if not tightened:
        return trial
    if binding.degraded.wheels is not None:
        _, quantum = _wheel_errors(codec)
        error = quantum / float(limits.speed[0])
        tightened["slip"] -= error
        if tightened["slip"] < LEAST_SLIP:
            raise InputError(
                "the wheel speeds are too coarse for the slip limit of the trial",
                where=trial.name,
                expected=f"a slip limit above {(LEAST_SLIP + error) / SLIP_SHARE:.1%}",
                found=f"limits.slip = {limits.slip}, quantum {quantum:.3g} m/s",
                remedy="raise limits.slip or limits.speed, or bind tooth times",
            )
    written = {name: _written(getattr(limits, name), value) for name, value in tightened.items()}
    return trial.model_copy(update={"limits": limits.model_copy(update=written)})


def _written(before: float, value: float) -> float:
    """A limit with another value, in the unit in which it was written."""
    if not isinstance(before, Quantity):
        return value
    return Quantity(value, before.unit, before.si, before.like(value))


def _check_times(trial: TrialFile, binding: Binding, codec: Codec) -> None:
    """Refuse a trial whose times do not suit the statuses and the watchdog of this bus."""
    silence, hand_back = trial.command.silence, binding.degraded.hand_back
    if hand_back is not None and float(hand_back) > float(silence):
        raise InputError(
            "the ECU gives the throttle back later than the trial requires",
            where=f"{binding.path}: degraded.hand_back",
            expected=f"at most {silence} (command.silence of {trial.name})",
            found=str(hand_back),
            remedy="raise command.silence in the trial, or shorten the watchdog of the ECU",
        )
    stale = float(trial.limits.stale)
    for carrier, plan in codec.plans.items():
        cycle = len(plan.pages) * (plan.message.cycle_time or 0.0)
        event = plan.message.attributes.get("GenMsgSendType")
        if not cycle or event or not any(part.name in SLOW_STATUS for part in plan.parts):
            continue
        limit = min(stale, float(binding.timeouts.get(carrier, stale)))
        if cycle >= limit:
            raise InputError(
                f"message {carrier} comes less often than its timeout allows",
                where=trial.name,
                expected=f"a timeout above its cycle time of {cycle * 1e3:g} ms",
                found=f"{shown(limit, trial.limits.stale)} (limits.stale, or timeout of the message)",
                remedy="raise limits.stale, or bind a message that comes more often",
            )


SLOW_STATUS = frozenset(
    {
        "EcuStatus",
        "ThrottleStatus",
        "EngineStatus",
        "RiderControls",
        "OpticalSpeed",
        "RearWheelSpeed",
        "FrontWheelSpeed",
    }
)


def _wheel_errors(codec: Codec) -> tuple[float, float]:
    """Longest cycle time (s) and sum of the quanta (m/s) of the wheel speeds."""
    period = quantum = 0.0
    for name in ("RearWheelSpeed", "FrontWheelSpeed"):
        for part in codec.parts(name):
            period = max(period, part.message.cycle_time or 0.0)
            quantum += abs(part.slot("speed").scale)
    return period, quantum

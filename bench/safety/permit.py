"""The last word before the bus: a command passes as it is, or the trial trips.

Written apart from the trial and from the controllers, and trusting neither: it decides on the
command itself and on the last state of rider and motorcycle. Whatever is not known (NaN)
counts as beyond its limit.
"""

from dataclasses import dataclass

from slipbench.bench.safety.vehicle_state import VehicleState
from slipbench.protocol.codec.messages import ActuatorCommand, Authority, TripReason
from slipbench.protocol.trial_file import RPM, Limits

# Float comparison only: a thousandth of the command's resolution on the wire.
TOLERANCE = 1e-7
# s; a float of seconds since 1970 is exact to 0.24 us, and a difference has two of them.
CLOCK_RESOLUTION = 1e-6
DEGREE = 0.017453292519943295  # rad


@dataclass(frozen=True, slots=True)
class Trip:
    """Reason for the immediate return of authority, for the record and as text."""

    reason: TripReason
    detail: str


@dataclass(frozen=True, slots=True)
class Held:
    """What the bench holds authority over, since the rider pressed the button.

    throttle     opening at the button, 0..1
    grip         the rider's grip at the button, 0..1
    gear         gear of the trial
    last         command sent last; its authority is NONE where none was sent yet
    requested_since  s, when authority was first requested
    """

    throttle: float
    grip: float
    gear: int
    last: ActuatorCommand
    requested_since: float


def permit(
    command: ActuatorCommand, held: Held, vehicle: VehicleState, limits: Limits, silence: float
) -> ActuatorCommand | Trip:
    """The command unchanged, or the trip that ends authority.

    A command without authority always passes, with neutral values. `silence` is the time in s
    after which the devices take authority back, and within which they must have granted it.
    """
    if command.authority == Authority.NONE:
        return ActuatorCommand(Authority.NONE, 0.0, 0.0, command.time)
    return (
        _timing(command, held, silence)
        or _links(vehicle, limits)
        or _granted(command, held, vehicle, silence)
        or _rider(vehicle, limits)
        or _grip(command, held, vehicle, limits)
        or _motion(vehicle, limits, held)
        or _throttle(command, held, limits)
        or _spark(command, held, limits)
        or command
    )


def _timing(command: ActuatorCommand, held: Held, silence: float) -> Trip | None:
    """Check the bench's own clock, on which every rate rests.

    After a stop of more than `silence` the bench holds no authority any more, and the state of the
    motorcycle has changed: the bench must not continue from its last command.
    """
    elapsed = command.time - held.last.time
    if 0.0 < elapsed <= silence + CLOCK_RESOLUTION:
        return None
    return Trip(TripReason.TIMING, f"the bench's last command was {elapsed * 1e3:.1f} ms ago")


def _links(vehicle: VehicleState, limits: Limits) -> Trip | None:
    """Check the bus, the recorder, and the devices at the other end."""
    if vehicle.bus_off:
        return Trip(TripReason.BUS_OFF, "the CAN controller is off the bus")
    if not vehicle.recording:
        return Trip(TripReason.RECORDER, "the recorder cannot write")
    if not 0.0 <= vehicle.oldest_age <= limits.stale:
        return Trip(
            TripReason.STALE, f"{vehicle.oldest}: silent for {vehicle.oldest_age * 1e3:.1f} ms"
        )
    if vehicle.faults >= limits.faults:
        return Trip(TripReason.FAULTY, f"{vehicle.faulty}: {vehicle.faults} faulty frames in a row")
    if vehicle.throttle.faulty:
        return Trip(TripReason.THROTTLE_FAULT, "the throttle body reports a fault")
    return None


def _granted(
    command: ActuatorCommand, held: Held, vehicle: VehicleState, silence: float
) -> Trip | None:
    """Check whether the devices grant what is requested, once the silence time is over."""
    if command.time - held.requested_since <= silence:
        return None
    requested, ecu, body = command.authority, vehicle.ecu.authority, vehicle.throttle.authority
    if ecu != requested:
        detail = f"asked for {requested.name}, the ECU grants {ecu.name}"
        return Trip(TripReason.AUTHORITY_LOST, detail)
    if body & Authority.THROTTLE != requested & Authority.THROTTLE:
        detail = f"asked for {requested.name}, the throttle body grants {body.name}"
        return Trip(TripReason.AUTHORITY_LOST, detail)
    return None


def _rider(vehicle: VehicleState, limits: Limits) -> Trip | None:
    """Check the rider's controls: any of them takes the motorcycle back."""
    if not vehicle.rider.button:
        return Trip(TripReason.BUTTON_RELEASED, "the rider let go of the button")
    for pressure in (vehicle.rider.front_brake, vehicle.rider.rear_brake):
        if not pressure < limits.brake_pressure:
            return Trip(TripReason.BRAKE, f"brake at {pressure / 1e5:.2f} bar")
    if not vehicle.rider.clutch < limits.clutch:
        return Trip(TripReason.CLUTCH, f"clutch at {vehicle.rider.clutch:.0%}")
    if not vehicle.rider.grip > limits.grip_closed:
        return Trip(TripReason.GRIP_CLOSED, f"grip at {vehicle.rider.grip:.1%}")
    return None


def _grip(
    command: ActuatorCommand, held: Held, vehicle: VehicleState, limits: Limits
) -> Trip | None:
    """Check that the grip does not move while the bench holds the throttle: the rider intervenes.

    It also bounds the throttle step when authority returns to the grip.
    """
    if not command.authority & Authority.THROTTLE:
        return None
    detail = f"grip at {vehicle.rider.grip:.1%}, at the button {held.grip:.1%}"
    if not vehicle.rider.grip >= held.grip - limits.throttle_deviation:
        return Trip(TripReason.GRIP_CLOSED, detail)
    if not vehicle.rider.grip <= held.grip + limits.throttle_deviation:
        return Trip(TripReason.GRIP_OPENED, detail)
    return None


def _motion(vehicle: VehicleState, limits: Limits, held: Held) -> Trip | None:
    """Check how the motorcycle moves; a wheel that locks or leaves the ground slips."""
    if vehicle.engine.gear != held.gear:
        return Trip(TripReason.GEAR, f"gear {vehicle.engine.gear}, the trial began in {held.gear}")
    if not _inside(vehicle.engine.engine_speed, limits.engine_speed):
        return Trip(
            TripReason.ENGINE_SPEED, f"engine at {vehicle.engine.engine_speed / RPM:.0f} rpm"
        )
    if not _inside(vehicle.speed, limits.speed):
        return Trip(TripReason.SPEED, f"{vehicle.speed:.1f} m/s")
    if not abs(vehicle.slip) <= limits.slip:
        return Trip(TripReason.SLIP, f"slip of {vehicle.slip:.1%}")
    if not abs(vehicle.front_slip) <= limits.front_slip:
        return Trip(TripReason.FRONT_WHEEL, f"front wheel {vehicle.front_slip:+.1%} off the speed")
    if not vehicle.distance <= limits.distance:
        return Trip(TripReason.DISTANCE, f"{vehicle.distance:.0f} m since the button")
    return None


def _throttle(command: ActuatorCommand, held: Held, limits: Limits) -> Trip | None:
    """Check the throttle of the command; without authority it must be neutral."""
    if not command.authority & Authority.THROTTLE:
        return _neutral("throttle", command.throttle)
    deviation = abs(command.throttle - held.throttle)
    if not deviation <= limits.throttle_deviation + TOLERANCE:
        return Trip(TripReason.AMPLITUDE, f"throttle {deviation:.2%} off the operating point")
    if not _inside(command.throttle, limits.throttle):
        return Trip(TripReason.RANGE, f"throttle command of {command.throttle:.2%}")
    requested = held.last.authority & Authority.THROTTLE
    before = held.last.throttle if requested else held.throttle
    return _rate("throttle", command.throttle - before, limits.throttle_rate, command, held)


def _spark(command: ActuatorCommand, held: Held, limits: Limits) -> Trip | None:
    """Check the spark offset of the command; without authority it must be neutral."""
    if not command.authority & Authority.SPARK:
        return _neutral("spark", command.spark)
    if not _inside(command.spark, limits.spark):
        return Trip(TripReason.RANGE, f"spark command of {command.spark / DEGREE:.2f} deg")
    before = held.last.spark if held.last.authority & Authority.SPARK else 0.0
    return _rate("spark", command.spark - before, limits.spark_rate, command, held)


def _neutral(actuator: str, value: float) -> Trip | None:
    if value == 0.0:
        return None
    return Trip(TripReason.RANGE, f"{actuator} of {value:.4g} without authority over it")


def _rate(
    actuator: str, change: float, limit: float, command: ActuatorCommand, held: Held
) -> Trip | None:
    elapsed = command.time - held.last.time
    if abs(change) <= limit * (elapsed + CLOCK_RESOLUTION):
        return None
    return Trip(TripReason.RATE, f"{actuator} asked to move {change:.4g} in {elapsed * 1e3:.2f} ms")


def _inside(value: float, bounds: tuple[float, float]) -> bool:
    """Whether `value` is within `bounds`; NaN is not."""
    return bounds[0] - TOLERANCE <= value <= bounds[1] + TOLERANCE

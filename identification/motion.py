"""How the vehicle moved: driven axle, reference speed and the slip between them."""

from dataclasses import dataclass, replace

import numpy as np

from identification.aligned import Aligned
from identification.dataset import Dataset, axle_signal
from identification.filters import bridged, line_reduction, low_pass, notch, wheel_frequency
from identification.rolling_radius import RadiusEstimate, rolling_ratio
from identification.slip import Slip, slip
from identification.wheels import AxleSpeed, NoAxleSpeed, axle_speed
from protocol.channel import FloatArray

CUTOFF = 60.0  # Hz, of the low pass before the notch
MOST_ORDERS = 3  # to be taken off; more of them would hollow out the band of a slow wheel
TRUE_SPEEDS = ("optical_speed",)
OTHER_SPEEDS = ("gnss_speed", "vehicle_speed")


@dataclass(frozen=True)
class Motion:
    """Speeds on one time base and the slip between them.

    raw              (n,) m/s, driven axle before the filters
    driven           (n,) m/s, low-passed, wheel orders taken off where teeth were timed
    reference        (n,) m/s
    wheel_frequency  (n,) Hz of the driven wheel; None where its radius is not known
    orders           wheel orders that were taken off
    notch_reduction  dB by which 1X got smaller; None where no notch was used
    """

    axle: AxleSpeed
    reference_name: str
    raw: FloatArray
    driven: FloatArray
    reference: FloatArray
    slip: Slip
    wheel_frequency: FloatArray | None
    radius: RadiusEstimate | None
    orders: tuple[int, ...] = ()
    notch_reduction: float | None = None


@dataclass(frozen=True)
class NoMotion:
    """Why there is no slip: what is missing, in words and as roles."""

    reason: str
    roles: tuple[str, ...]


def motion(data: Aligned, base: Dataset) -> Motion | NoMotion:
    """Find driven and reference speed in a recording and form the slip."""
    driven_axle = data.recording.roles.vehicle.driven_axle
    axle = axle_speed(data, "front" if driven_axle == "front" else "rear")
    if isinstance(axle, NoAxleSpeed):
        reason = axle.reason or "no channel tells how fast the driven wheels turn"
        return NoMotion(reason, (" or ".join(axle.roles),))
    found = _reference(data, base, axle.axle, driven_axle)
    if isinstance(found, NoMotion):
        return found
    return _moved(axle, axle_signal(axle, base.time), *found, base)


def _moved(
    axle: AxleSpeed, raw: FloatArray, reference: FloatArray, name: str, base: Dataset
) -> Motion:
    driven, reference = (low_pass(x, base.rate, CUTOFF) for x in (raw, reference))
    radius = rolling_ratio(driven, reference, base.get("throttle_position"))
    move = Motion(axle, name, raw, driven, reference, slip(driven, reference), None, radius)
    return _without_line(move, base.rate) if axle.radius and axle.teeth_per_turn else move


def _without_line(move: Motion, rate: float) -> Motion:
    assert move.axle.radius is not None
    frequency = wheel_frequency(move.raw, rate, move.axle.radius)
    if not np.isfinite(frequency).any():
        return move
    orders = passing_orders(float(np.nanmedian(frequency)))
    driven = move.driven
    for order in orders:
        driven = notch(driven, frequency, rate, order)
    known = np.isfinite(move.driven) & np.isfinite(frequency)
    angle = 2 * np.pi * np.cumsum(bridged(frequency)) / rate
    reduction = line_reduction(move.driven[known], driven[known], angle[known])
    return replace(
        move, driven=driven, slip=slip(driven, move.reference), wheel_frequency=frequency,
        orders=orders, notch_reduction=reduction,
    )  # fmt: skip


def passing_orders(frequency: float) -> tuple[int, ...]:
    """Wheel orders that the low pass lets through, the first `MOST_ORDERS` of them. Hz."""
    count = int(1.5 * CUTOFF / frequency) if frequency > 0.5 else 0
    return tuple(range(1, min(count, MOST_ORDERS) + 1))


def _reference(
    data: Aligned, base: Dataset, driven: str, axles: str
) -> tuple[FloatArray, str] | NoMotion:
    """Take true speed where it was measured, else the other axle, else a speed over ground."""
    for role in TRUE_SPEEDS:
        if data.has(role):
            return base.signals[role], f"{role.replace('_', ' ')} ({_origin(data, role)})"
    other = axle_speed(data, "front" if driven == "rear" else "rear")
    if isinstance(other, AxleSpeed):
        both = ", driven too: slip is of one axle against the other" if axles == "both" else ""
        return axle_signal(other, base.time), f"{other.axle} axle{both}: {other.method}"
    for role in OTHER_SPEEDS:
        if data.has(role):
            return base.signals[role], f"{role.replace('_', ' ')} ({_origin(data, role)})"
    wanted = (*TRUE_SPEEDS, *other.roles, *OTHER_SPEEDS)
    return NoMotion(other.reason or "no reference speed", (" or ".join(wanted),))


def _origin(data: Aligned, role: str) -> str:
    return data.recording.channels[role].origin

"""Motion of the vehicle: driven axle, reference speed and the slip between them."""

from dataclasses import dataclass, replace

import numpy as np

from slipbench.identification.signals.aligned import Aligned
from slipbench.identification.signals.dataset import Dataset, axle_signal
from slipbench.identification.signals.filters import (
    bridged,
    line_reduction,
    low_pass,
    notch,
    wheel_frequency,
)
from slipbench.identification.signals.rolling_radius import RadiusEstimate, rolling_ratio
from slipbench.identification.signals.slip import Slip, slip
from slipbench.identification.signals.tooth_pitch import NoToothPitch, ToothPitch
from slipbench.identification.signals.true_teeth import pitch_of, with_true_teeth
from slipbench.identification.signals.wheels import AxleSpeed, NoAxleSpeed, axle_speed
from slipbench.protocol.recording.channel import FloatArray

CUTOFF = 60.0  # Hz, of the low pass before the notch
MOST_ORDERS = 3  # to be taken off; more of them would hollow out the band of a slow wheel
TRUE_SPEEDS = ("optical_speed",)
OTHER_SPEEDS = ("gnss_speed", "vehicle_speed")


@dataclass(frozen=True)
class Motion:
    """Speeds on one time base and the slip between them.

    axle             the driven one; where its gaps were learnt, they are corrected in its parts
    raw              (n,) m/s, driven axle before the filters and with equal gaps between teeth
    driven           (n,) m/s, low-passed, free of the teeth's errors or of the wheel's orders
    reference        (n,) m/s
    wheel_frequency  (n,) Hz of the driven wheel; None where its radius is not known
    pitch            gaps between the teeth, or why notches took their place; None without teeth
    orders           wheel orders that notches took off; none where the gaps were learnt
    line_reduction   dB by which 1X got smaller; None where teeth were not timed
    """

    axle: AxleSpeed
    reference_name: str
    raw: FloatArray
    driven: FloatArray
    reference: FloatArray
    slip: Slip
    wheel_frequency: FloatArray | None
    radius: RadiusEstimate | None
    pitch: ToothPitch | NoToothPitch | None = None
    orders: tuple[int, ...] = ()
    line_reduction: float | None = None


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
        reason = axle.reason or "no channel gives the speed of the driven wheels"
        return NoMotion(reason, (" or ".join(axle.roles),))
    found = _reference(data, base, axle.axle, driven_axle)
    if isinstance(found, NoMotion):
        return found
    return _moved(axle, data, *found, base)


def _moved(
    axle: AxleSpeed, data: Aligned, reference: FloatArray, name: str, base: Dataset
) -> Motion:
    raw = axle_signal(axle, base.time)
    driven, reference = (low_pass(x, base.rate, CUTOFF) for x in (raw, reference))
    radius = rolling_ratio(driven, reference, base.get("throttle_position"))
    move = Motion(axle, name, raw, driven, reference, slip(driven, reference), None, radius)
    return _without_line(move, data, base) if axle.radius and axle.teeth_per_turn else move


def _without_line(move: Motion, data: Aligned, base: Dataset) -> Motion:
    """Put the teeth where they stand; where that cannot be learnt, notch the orders out."""
    assert move.axle.radius is not None
    frequency = wheel_frequency(move.raw, base.rate, move.axle.radius)
    if not np.isfinite(frequency).any():
        return move
    pitch = pitch_of(move.axle, data, base)
    if isinstance(pitch, ToothPitch):
        orders: tuple[int, ...] = ()
        axle = with_true_teeth(move.axle, pitch, data)
        driven = low_pass(axle_signal(axle, base.time), base.rate, CUTOFF)
    else:
        axle, orders = move.axle, passing_orders(float(np.nanmedian(frequency)))
        driven = notched(move.driven, frequency, base.rate, orders)
    return replace(
        move,
        axle=axle,
        driven=driven,
        slip=slip(driven, move.reference),
        pitch=pitch,
        wheel_frequency=frequency,
        orders=orders,
        line_reduction=_reduction(move.driven, driven, frequency, base.rate),
    )


def notched(
    value: FloatArray, frequency: FloatArray, rate: float, orders: tuple[int, ...]
) -> FloatArray:
    """Signal without several wheel orders, shape (n,). frequency: of the wheel, Hz, shape (n,)."""
    for order in orders:
        value = notch(value, frequency, rate, order)
    return value


def _reduction(
    before: FloatArray, after: FloatArray, frequency: FloatArray, rate: float
) -> float | None:
    known = np.isfinite(before) & np.isfinite(after) & np.isfinite(frequency)
    angle = 2 * np.pi * np.cumsum(bridged(frequency)) / rate
    if not known.any():
        return None
    return line_reduction(before[known], after[known], angle[known])


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
        other = _with_pitch(other, data, base)
        return axle_signal(other, base.time), f"{other.axle} axle{both}: {other.method}"
    for role in OTHER_SPEEDS:
        if data.has(role):
            return base.signals[role], f"{role.replace('_', ' ')} ({_origin(data, role)})"
    roles = (*TRUE_SPEEDS, *other.roles, *OTHER_SPEEDS)
    return NoMotion(other.reason or "no reference speed", (" or ".join(roles),))


def _with_pitch(axle: AxleSpeed, data: Aligned, base: Dataset) -> AxleSpeed:
    pitch = pitch_of(axle, data, base)
    return with_true_teeth(axle, pitch, data) if isinstance(pitch, ToothPitch) else axle


def _origin(data: Aligned, role: str) -> str:
    return data.recording.channels[role].origin

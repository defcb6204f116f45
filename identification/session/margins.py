"""Margins of a run to the limits of its trial: the least share of the range that was not used."""

import math
from collections.abc import Iterator

import numpy as np

from slipbench.identification.response.identify import Identification
from slipbench.identification.signals.wheels import AxleSpeed, axle_speed
from slipbench.protocol.codec.messages import Authority, Phase
from slipbench.protocol.recording.channel import FloatArray
from slipbench.protocol.trial_file import Limits

HOLDING = (Phase.EXCITING, Phase.SETTLING, Phase.HANDING_BACK)
OF_THE_COMMAND = ("throttle", "throttle_deviation", "throttle_rate", "spark", "spark_rate")
OF_THE_MOTORCYCLE = ("engine_speed", "speed", "slip", "front_slip")
"""Limits whose margin depends on how the motorcycle responds to the amplitude."""


def margins(found: Identification) -> dict[str, float]:
    """Margin to each limit while the bench had authority; 1: as at the button, below 0: beyond it.

    Limits whose signal was not recorded are left out.
    """
    trial, phase = found.recording.trial, found.base.get("trial_phase")
    if trial is None or phase is None:
        return {}
    held = np.isin(phase, [int(each) for each in HOLDING])
    if not held.any():
        return {}
    return {
        name: margin for name, margin in _each(found, trial.limits, held) if math.isfinite(margin)
    }


def _each(found: Identification, of: Limits, held: np.ndarray) -> Iterator[tuple[str, float]]:
    def signal(role: str) -> FloatArray:
        value = found.base.get(role)
        return np.full(held.sum(), np.nan) if value is None else value[held]

    yield from _of_requests(found, of)
    if requests(found, "throttle"):
        grip = signal("rider_grip")
        yield "grip", _within(grip - _first(grip), of.throttle_deviation)
    yield "engine_speed", _between(signal("engine_speed"), *of.engine_speed)
    yield "speed", _between(signal("optical_speed"), *of.speed)
    began, ended = found.base.time[np.flatnonzero(held)[[0, -1]]]
    for name, axle, limit in (("slip", "rear", of.slip), ("front_slip", "front", of.front_slip)):
        time, ratio = _slip_of_frames(found, axle)
        yield name, _within(ratio[(time >= began) & (time <= ended)], limit)
    speed = signal("optical_speed")
    yield "distance", _within(np.array([np.nansum(speed) / found.base.rate]), of.distance)
    brakes = [signal("front_brake_pressure"), signal("rear_brake_pressure")]
    yield "brake_pressure", min(_within(each, of.brake_pressure) for each in brakes)
    yield "clutch", _within(signal("clutch"), of.clutch)


def _of_requests(found: Identification, of: Limits) -> Iterator[tuple[str, float]]:
    """Margins of the requested commands, frame by frame."""
    throttle, spark = (requests(found, name) for name in ("throttle", "spark"))
    if throttle and np.ptp(throttle["value"]) > 0:
        value = throttle["value"]
        yield "throttle", _between(value, *of.throttle)
        yield "throttle_deviation", _within(value - _first(value), of.throttle_deviation)
        yield "throttle_rate", _within(_rate(throttle), of.throttle_rate)
    if spark and np.ptp(spark["value"]) > 0:
        yield "spark", _between(spark["value"], *of.spark)
        yield "spark_rate", _within(_rate(spark), of.spark_rate)


def requests(found: Identification, actuator: str) -> dict[str, FloatArray]:
    """Time (s) and value of the requests with authority over an actuator; empty where unknown. (n,) each."""
    channels = found.recording.channels
    value, authority = channels.get(f"{actuator}_request"), channels.get("authority_request")
    if value is None or authority is None or value.time.size != authority.time.size:
        return {}
    bit = Authority.THROTTLE if actuator == "throttle" else Authority.SPARK
    ours = (authority.value.astype(int) & int(bit)) != 0
    return {"time": value.time[ours], "value": value.value[ours]} if ours.any() else {}


def _rate(requests: dict[str, FloatArray]) -> FloatArray:
    """Rate of change from frame to frame, over at least the usual time between two frames."""
    step = np.diff(requests["time"])
    least = float(np.median(step)) if step.size else math.nan
    return np.diff(requests["value"]) / np.maximum(step, least)


def _slip_of_frames(found: Identification, axle: str) -> tuple[FloatArray, FloatArray]:
    """Time (s) and slip of a wheel for each frame of teeth, as the vehicle monitor computes it.

    The speed is the mean over the teeth of one frame; nothing is filtered.
    """
    nothing: FloatArray = np.empty(0)
    teeth = found.recording.channels.get(f"{axle}_teeth")
    optical = found.recording.channels.get("optical_speed")
    wheel = axle_speed(found.data, axle)
    if teeth is None or teeth.arrival is None or optical is None:
        return nothing, nothing
    if not isinstance(wheel, AxleSpeed) or not wheel.radius or not wheel.teeth_per_turn:
        return nothing, nothing
    last = np.flatnonzero(np.diff(teeth.arrival, append=np.inf) > 0)
    pitch = 2 * np.pi * wheel.radius / wheel.teeth_per_turn
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = pitch * np.diff(teeth.value[last]) / np.diff(teeth.time[last])
        arrival = teeth.arrival[last][1:]
        return arrival, speed / np.interp(arrival, optical.time, optical.value) - 1.0


def _first(value: FloatArray) -> float:
    known = value[np.isfinite(value)]
    return float(known[0]) if known.size else math.nan


def _within(value: FloatArray, limit: float) -> float:
    """Margin of a magnitude to its largest value; NaN where nothing is known."""
    known = np.abs(value[np.isfinite(value)])
    return 1.0 - float(known.max()) / limit if known.size else math.nan


def _between(value: FloatArray, low: float, high: float) -> float:
    """Margin to both bounds, each relative to its distance at the button; NaN: nothing is known."""
    known = value[np.isfinite(value)]
    if not known.size or not low < known[0] < high:
        return math.nan
    start = float(known[0])
    return min(
        (float(known.min()) - low) / (start - low), (high - float(known.max())) / (high - start)
    )

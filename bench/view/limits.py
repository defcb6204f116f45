"""How much of each limit of a trial is in use: 0 at the operating point, 1 at the limit."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from slipbench.bench.safety.vehicle_state import VehicleState
from slipbench.protocol.codec.messages import ActuatorCommand, Authority
from slipbench.protocol.trial_file import Limits

LIMITS = (
    *("slip", "front_slip", "engine_speed", "speed", "distance"),
    *("throttle_deviation", "grip", "throttle", "spark"),
    *("brake_pressure", "clutch", "stale", "faults"),
)
"""Names of the limits that can be in use."""


@dataclass(frozen=True)
class AtButton:
    """Opening and grip (0..1), engine speed (rad/s) and speed (m/s) when the button was pressed."""

    throttle: float
    grip: float
    engine_speed: float
    speed: float


def used_limits(
    vehicle: VehicleState, command: ActuatorCommand | None, begun: AtButton | None, of: Limits
) -> dict[str, float]:
    """Share of each limit in use, dimensionless: 1 trips. What is not known yet is left out.

    begun: None before the button, where only limits of the motorcycle and of the rider count.
    """
    shares = {**dict(_motion(vehicle, begun, of)), **dict(_rider(vehicle, of))}
    if begun is not None:
        shares["distance"] = vehicle.distance / of.distance
        shares.update(_command(vehicle, command, begun, of))
    return {name: share for name, share in shares.items() if math.isfinite(share)}


def _motion(
    vehicle: VehicleState, begun: AtButton | None, of: Limits
) -> Iterator[tuple[str, float]]:
    yield "slip", abs(vehicle.slip) / of.slip
    yield "front_slip", abs(vehicle.front_slip) / of.front_slip
    rpm, speed = (begun.engine_speed, begun.speed) if begun else (math.nan, math.nan)
    yield "engine_speed", _between(vehicle.engine.engine_speed, of.engine_speed, rpm)
    yield "speed", _between(vehicle.speed, of.speed, speed)


def _rider(vehicle: VehicleState, of: Limits) -> Iterator[tuple[str, float]]:
    brakes = (vehicle.rider.front_brake, vehicle.rider.rear_brake)
    yield "brake_pressure", max(brakes) / of.brake_pressure
    yield "clutch", vehicle.rider.clutch / of.clutch
    yield "stale", vehicle.oldest_age / of.stale
    yield "faults", vehicle.faults / of.faults


def _command(
    vehicle: VehicleState, command: ActuatorCommand | None, begun: AtButton, of: Limits
) -> Iterator[tuple[str, float]]:
    """Shares of the limits that hold while the bench has authority."""
    if command is None:
        return
    if command.authority & Authority.THROTTLE:
        deviation = abs(command.throttle - begun.throttle)
        yield "throttle_deviation", deviation / of.throttle_deviation
        yield "grip", abs(vehicle.rider.grip - begun.grip) / of.throttle_deviation
        yield "throttle", _between(command.throttle, of.throttle, begun.throttle)
    if command.authority & Authority.SPARK:
        yield "spark", _between(command.spark, of.spark, 0.0)


def _between(value: float, bounds: tuple[float, float], start: float) -> float:
    """Share of the way from `start` to the bound on that side; without a start, from the middle."""
    low, high = bounds
    if not low < start < high:
        start = (low + high) / 2
    return (value - start) / ((high if value >= start else low) - start)

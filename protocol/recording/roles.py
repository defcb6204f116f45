"""Roles: the names of channels here, whatever a vehicle calls them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Role:
    """Meaning of a channel. `unit` is SI; "count" marks tooth counts."""

    name: str
    unit: str
    meaning: str


_AXLES = [
    Role(f"{axle}_{what}", unit, f"{axle} {meaning}")
    for axle in ("rear", "front")
    for what, unit, meaning in (
        ("teeth", "count", "encoder: the time and running count of every tooth"),
        ("tooth_counter", "count", "encoder: a wrapping tooth counter, sampled"),
        ("wheel_speed", "m/s", "wheel: peripheral speed"),
        ("left_wheel_speed", "m/s", "left wheel: peripheral speed"),
        ("right_wheel_speed", "m/s", "right wheel: peripheral speed"),
        ("brake_pressure", "Pa", "brake pressure"),
        ("suspension_travel", "m", "suspension travel, compression positive"),
        ("tyre_temperature", "K", "tyre temperature"),
    )
]

_OTHERS = [
    Role("throttle_command", "1", "commanded opening of the servo, echoed by the ECU, 0..1"),
    Role("throttle_position", "1", "measured opening, 0..1"),
    Role("throttle_current", "A", "motor current of the throttle servo"),
    Role("spark_command", "rad", "offset from the spark map, echoed by the ECU"),
    Role("spark_advance", "rad", "advance applied"),
    Role("engine_speed", "rad/s", "crank speed"),
    Role("gear", "1", "gear engaged, 0 neutral"),
    Role("optical_speed", "m/s", "true longitudinal speed, optical sensor"),
    Role("gnss_speed", "m/s", "speed over ground from satellites"),
    Role("vehicle_speed", "m/s", "speed as the vehicle itself reports it"),
    Role("lean_angle", "rad", "roll angle, right positive"),
    Role("course", "rad", "direction of travel over ground"),
    Role("latitude", "rad", "geographic latitude, north positive"),
    Role("longitude", "rad", "geographic longitude, east positive"),
    Role("altitude", "m", "height above the sea or the ellipsoid, as the receiver has it"),
    Role("yaw_rate", "rad/s", "yaw rate"),
    Role("pitch_rate", "rad/s", "pitch rate"),
    Role("steering_angle", "rad", "steering angle"),
    Role("longitudinal_acceleration", "m/s^2", "acceleration forwards"),
    Role("lateral_acceleration", "m/s^2", "acceleration sideways"),
    Role("rider_button", "1", "the rider's trial button"),
    Role("rider_grip", "1", "the rider's grip or pedal, 0..1"),
    Role("brake", "1", "brake applied, 0..1"),
    Role("clutch", "1", "clutch pulled, 0..1"),
    Role("authority", "1", "authority granted: 0 none, 1 throttle, 2 spark, 3 both"),
    Role("authority_request", "1", "authority that the bench requests, as authority"),
    Role("throttle_request", "1", "opening that the bench requests, 0..1"),
    Role("spark_request", "rad", "offset from the spark map that the bench requests"),
    Role("request_time", "s", "the bench's clock at its request"),
    Role("throttle_authority", "1", "authority that the throttle body grants, as authority"),
    Role("throttle_fault", "1", "the throttle body reports a fault"),
    Role("trial_authority", "1", "authority that the trial requests at present"),
    Role("trial_tick", "1", "running count of the bench's ticks"),
    Role("trial_phase", "1", "phase of the trial, as in slipbench.protocol.codec.messages.Phase"),
    Role("trip_reason", "1", "as in slipbench.protocol.codec.messages.TripReason"),
    Role("manifold_pressure", "Pa", "absolute manifold pressure"),
    Role("coolant_temperature", "K", "coolant temperature"),
    Role("intake_temperature", "K", "intake air temperature"),
]

ROLES: dict[str, Role] = {role.name: role for role in (*_AXLES, *_OTHERS)}

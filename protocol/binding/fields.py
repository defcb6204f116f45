"""Which role each field of the bench's messages has."""

from dataclasses import dataclass

NAN = float("nan")


@dataclass(frozen=True)
class Field:
    """One field of a message of the bench. si: unit; "" for a pure number; None: no conversion."""

    message: str
    field: str
    si: str | None


FIELDS: dict[str, Field] = {
    "authority_request": Field("ActuatorCommand", "authority", None),
    "throttle_request": Field("ActuatorCommand", "throttle", ""),
    "spark_request": Field("ActuatorCommand", "spark", "rad"),
    "request_time": Field("ActuatorCommand", "time", "s"),
    "authority": Field("EcuStatus", "authority", None),
    "throttle_command": Field("EcuStatus", "throttle_command", ""),
    "spark_command": Field("EcuStatus", "spark_command", "rad"),
    "throttle_authority": Field("ThrottleStatus", "authority", None),
    "throttle_position": Field("ThrottleStatus", "position", ""),
    "throttle_current": Field("ThrottleStatus", "motor_current", "A"),
    "throttle_fault": Field("ThrottleStatus", "faulty", None),
    "engine_speed": Field("EngineStatus", "engine_speed", "rad/s"),
    "gear": Field("EngineStatus", "gear", None),
    "spark_advance": Field("EngineStatus", "spark_advance", "rad"),
    "rear_wheel_speed": Field("RearWheelSpeed", "speed", "m/s"),
    "front_wheel_speed": Field("FrontWheelSpeed", "speed", "m/s"),
    "optical_speed": Field("OpticalSpeed", "speed", "m/s"),
    "gnss_speed": Field("OpticalSpeed", "speed", "m/s"),
    "rider_button": Field("RiderControls", "button", None),
    "rider_grip": Field("RiderControls", "grip", ""),
    "front_brake_pressure": Field("RiderControls", "front_brake", "Pa"),
    "rear_brake_pressure": Field("RiderControls", "rear_brake", "Pa"),
    "clutch": Field("RiderControls", "clutch", ""),
    "front_suspension_travel": Field("ChassisStatus", "front_travel", "m"),
    "rear_suspension_travel": Field("ChassisStatus", "rear_travel", "m"),
    "coolant_temperature": Field("Temperatures", "coolant", "K"),
    "intake_temperature": Field("Temperatures", "intake_air", "K"),
    "rear_tyre_temperature": Field("Temperatures", "rear_tyre", "K"),
    "front_tyre_temperature": Field("Temperatures", "front_tyre", "K"),
    "trial_phase": Field("TrialStatus", "phase", None),
    "trial_authority": Field("TrialStatus", "authority", None),
    "trip_reason": Field("TrialStatus", "trip", None),
    "trial_tick": Field("TrialStatus", "tick", None),
}

TIMES = {  # message: the roles of which the first that is bound gives the sender's own time
    "EcuStatus": ("throttle_command", "authority", "spark_command"),
    "ThrottleStatus": ("throttle_position",),
    "EngineStatus": ("engine_speed",),
    "OpticalSpeed": ("optical_speed", "gnss_speed"),
}

# Values of fields that no signal holds. A field that is not here must have a role, or its message is
# not on this bus.
CONSTANTS: dict[str, dict[str, float]] = {
    "ActuatorCommand": {"spark": 0.0, "time": 0.0},
    "EcuStatus": {"spark_command": 0.0, "time": NAN},
    "ThrottleStatus": {"motor_current": NAN, "time": NAN},
    "EngineStatus": {"spark_advance": NAN, "time": NAN},
    "OpticalSpeed": {"valid": True, "time": NAN},
    "RiderControls": {"front_brake": 0.0, "rear_brake": 0.0},
    "ChassisStatus": {"front_travel": 0.0, "rear_travel": 0.0},
    "Temperatures": {"coolant": 0.0, "intake_air": 0.0, "rear_tyre": 0.0, "front_tyre": 0.0},
    "TrialStatus": {"authority": 0, "trip": 0, "tick": 0},
}
ANCHOR = ("tooth_count", "tooth_time", "teeth_per_turn", "faulty")
UNMONITORED = {
    "gear": ("EngineStatus", "gear", 0),
    "clutch": ("RiderControls", "clutch", 0.0),
    "throttle_fault": ("ThrottleStatus", "faulty", False),
}

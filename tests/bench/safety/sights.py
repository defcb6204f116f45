"""A motorcycle under the bench's hand, in numbers that a float holds exactly.

Every limit is a sum of powers of two, so a test can stand on it, and one float beyond it.
"""

import math
from dataclasses import replace
from typing import Any

from slipbench.bench.safety.permit import Held
from slipbench.bench.safety.vehicle_state import VehicleState
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    EcuStatus,
    EngineStatus,
    RiderControls,
    ThrottleStatus,
)
from slipbench.protocol.trial_file import Limits

LIMITS = Limits.model_construct(  # unchecked: limits that are sums of powers of two, in SI
    throttle=(0.0625, 0.5),
    throttle_deviation=0.125,
    throttle_rate=4.0,
    spark=(-0.25, 0.125),
    spark_rate=16.0,
    engine_speed=(1024.0, 1536.0),
    speed=(32.0, 64.0),
    slip=0.125,
    front_slip=0.25,
    distance=2048.0,
    grip_closed=0.03125,
    brake_pressure=262144.0,
    clutch=0.125,
    stale=0.015625,
    faults=3,
)
SILENCE = 0.03125  # s
NOW = 16.0  # s
PERIOD = 2.0**-10  # s
OPENING, GRIP, GEAR = 0.25, 0.1875, 2
THROTTLE, SPARK, BOTH, NONE = Authority.THROTTLE, Authority.SPARK, Authority.BOTH, Authority.NONE


def vehicle_state(authority: Authority = THROTTLE, **changes: Any) -> VehicleState:
    """All as it must be for a command to pass."""
    fine = VehicleState(
        ecu=EcuStatus(authority, OPENING, 0.0, NOW),
        throttle=ThrottleStatus(authority, OPENING, 0.0, False, NOW),
        engine=EngineStatus(1280.0, GEAR, 0.5, NOW),
        rider=RiderControls(True, GRIP, 0.0, 0.0, 0.0),
        speed=48.0,
        slip=0.0,
        front_slip=0.0,
        distance=100.0,
        oldest_age=0.0078125,
        oldest="EngineStatus",
        faulty="RearTeeth",
    )
    return changed(fine, **changes)


def changed(sight: VehicleState, **changes: Any) -> VehicleState:
    """Another sight: `rider__grip=0.1` changes one field of one status."""
    for path, value in changes.items():
        status, _, field = path.partition("__")
        new = replace(getattr(sight, status), **{field: value}) if field else value
        sight = replace(sight, **{status: new})
    return sight


def command(authority: Authority = THROTTLE, **changes: Any) -> ActuatorCommand:
    """What the trial asks for now: the operating point, or no offset from the map."""
    throttle = OPENING if authority & THROTTLE else 0.0
    return replace(ActuatorCommand(authority, throttle, 0.0, NOW), **changes)


def held(authority: Authority = THROTTLE, **changes: Any) -> Held:
    """The bench has held authority for a second, and sent the operating point a tick ago."""
    last = command(authority, time=NOW - PERIOD)
    return replace(Held(OPENING, GRIP, GEAR, last, NOW - 1.0), **changes)


def above(value: float) -> float:
    """The next float."""
    return math.nextafter(value, math.inf)


def below(value: float) -> float:
    """The float before."""
    return math.nextafter(value, -math.inf)

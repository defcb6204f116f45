"""What the gateway last saw of the motorcycle, as one value that decisions are made on."""

import math
from dataclasses import dataclass

from protocol.messages import Authority


@dataclass(frozen=True, slots=True)
class Seen:
    """A snapshot at one tick; NaN where a status has not been seen yet.

    oldest_age and oldest name the safety-relevant status that has been silent longest;
    faults and faulty name the message with the most faulty frames in a row.
    """

    authority: Authority = Authority.NONE  # granted by the ECU
    throttle_command: float = math.nan  # what the servo is told, bench or rider, 0..1
    throttle_faulty: bool = False
    engine_speed: float = math.nan  # rad/s
    gear: int = 0
    button: bool = False
    grip: float = math.nan  # opening that the rider asks for, 0..1
    brake_pressure: float = math.nan  # Pa, the larger of both
    clutch: float = math.nan  # 0 released .. 1 pulled
    speed: float = math.nan  # m/s
    slip: float = math.nan
    distance: float = 0.0  # m since the button was pressed
    oldest_age: float = math.inf  # s
    oldest: str = ""
    faults: int = 0
    faulty: str = ""
    bus_off: bool = False
    recording: bool = True

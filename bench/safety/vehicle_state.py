"""State of rider and motorcycle as last received by the gateway."""

import math
from dataclasses import dataclass

from slipbench.protocol.codec.messages import (
    Authority,
    EcuStatus,
    EngineStatus,
    RiderControls,
    ThrottleStatus,
)

NAN = math.nan
NO_ECU = EcuStatus(Authority.NONE, NAN, NAN, NAN)
NO_THROTTLE = ThrottleStatus(Authority.NONE, NAN, NAN, False, NAN)
NO_ENGINE = EngineStatus(NAN, 0, NAN, NAN)
NO_RIDER = RiderControls(False, NAN, NAN, NAN, NAN)


@dataclass(frozen=True, slots=True)
class VehicleState:
    """Snapshot at one tick: the last good status of each kind; NaN before the first.

    speed            m/s, optical
    slip             of the rear wheel against `speed`; negative where it turns too slowly
    front_slip       of the front wheel against `speed`: it rolls, so this is near zero
    distance         m since the button was pressed
    oldest_age       s, silence of the safety-relevant status that has been silent longest
    oldest           its name
    faults, faulty   most faulty frames in a row of one message, and its name
    bus_off          the controller has left the bus
    recording        the recorder takes and writes frames
    """

    ecu: EcuStatus = NO_ECU
    throttle: ThrottleStatus = NO_THROTTLE
    engine: EngineStatus = NO_ENGINE
    rider: RiderControls = NO_RIDER
    speed: float = NAN
    slip: float = NAN
    front_slip: float = NAN
    distance: float = 0.0
    oldest_age: float = math.inf
    oldest: str = "every status"
    faults: int = 0
    faulty: str = ""
    bus_off: bool = False
    recording: bool = True

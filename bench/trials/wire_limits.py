"""A trial asks for nothing, and is bounded by nothing, that its frames cannot carry.

A command beyond its signal could not be sent, and a limit beyond its sensor's signal would never
trip: both are refused when the trial file is read, not on the straight.
"""

from collections.abc import Iterator
from operator import attrgetter

from slipbench.bench.trials.excitation import Excitation
from slipbench.protocol.codec.slot import Slot, slot
from slipbench.protocol.database.layout import Database
from slipbench.protocol.errors import InputError
from slipbench.protocol.trial_file import TrialFile

# What the trial file says (a value or two bounds), and the signal that carries it.
CARRIED = {
    "limits.throttle": ("ActuatorCommand", "throttle"),
    "limits.spark": ("ActuatorCommand", "spark"),
    "limits.engine_speed": ("EngineStatus", "engine_speed"),
    "limits.speed": ("OpticalSpeed", "speed"),
    "limits.grip_closed": ("RiderControls", "grip"),
    "limits.brake_pressure": ("RiderControls", "front_brake"),
    "limits.clutch": ("RiderControls", "clutch"),
    "operating_point.engine_speed": ("EngineStatus", "engine_speed"),
    "operating_point.gear": ("EngineStatus", "gear"),
}
ROUNDING = 1e-9  # of the range: a limit that is the signal's own stands in other units


def check_wire(trial: TrialFile, excitation: Excitation, database: Database, where: str) -> None:
    """Refuse what `database` cannot carry; raises InputError that names every such value."""
    faults = [*_beyond(trial, database), *_too_fine(excitation, database)]
    if faults:
        raise InputError(
            "; ".join(faults),
            where=where,
            expected=f"what the frames of {database.origin} carry",
            remedy="change the trial, or give the motorcycle's own database with --dbc",
        )


def _beyond(trial: TrialFile, database: Database) -> Iterator[str]:
    for key, (message, name) in CARRIED.items():
        place = _place(database, message, name)
        low, high = (raw * place.scale + place.offset for raw in (place.low, place.high))
        slack = ROUNDING * (high - low)
        stated = attrgetter(key)(trial)
        values = stated if isinstance(stated, tuple) else (stated,)
        if not all(low - slack <= value <= high + slack for value in values):
            told = " .. ".join(f"{value:.4g}" for value in values)
            yield f"{key} = {told} is not in {low:.4g} .. {high:.4g} ({message}.{name}, SI)"


def _too_fine(excitation: Excitation, database: Database) -> Iterator[str]:
    """Tell of an excitation that the command's resolution would round to nothing."""
    if excitation.actuator == "slip":  # a target, which is on no wire
        return
    step = _place(database, "ActuatorCommand", excitation.actuator).scale
    swing = float(abs(excitation.table).max())
    if swing < step:
        yield (
            f"the excitation of {swing:.3g} is less than one step of"
            f" ActuatorCommand.{excitation.actuator} ({step:.3g}, SI)"
        )


def _place(database: Database, message: str, name: str) -> Slot:
    return slot(database, database.message(message), name, float)

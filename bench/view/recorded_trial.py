"""The trial of a run folder: its plan, binding and wheels, from the copies in the folder alone."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slipbench.bench.safety.trial import Plan, plan_of
from slipbench.bench.safety.vehicle_monitor import Wheels
from slipbench.bench.trials.degraded import degraded_trial
from slipbench.bench.trials.excitation import plan_excitation
from slipbench.bench.vehicle.virtual_motorcycle import read_vehicle, wheels_of
from slipbench.protocol.binding.binding import Binding, bind, own_binding
from slipbench.protocol.configuration import load_toml, read_toml
from slipbench.protocol.controller_file import ControllerFile
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.database_copy import find_database
from slipbench.protocol.recording.role_map import RoleMap
from slipbench.protocol.recording.run_folder import DESCRIPTION, ROLES, TRIAL, VEHICLE
from slipbench.protocol.trial_file import TrialFile

CONTROLLER = "controller.toml"
OWN_MESSAGES = {"ActuatorCommand", "EcuStatus", "ThrottleStatus", "TrialStatus"}


@dataclass(frozen=True)
class RecordedTrial:
    """A trial whose frames lie, or will lie, in a run folder.

    buses     their names in the log, by their numbers
    bitrate   bit/s; 0 where unknown
    """

    folder: Path
    plan: Plan
    binding: Binding
    wheels: Wheels
    buses: tuple[str, ...]
    bitrate: float


def recorded_trial(folder: Path) -> RecordedTrial:
    """Trial of a run folder. Raises InputError where the folder holds no recording of a trial."""
    missing = [
        name for name in (DESCRIPTION, TRIAL, VEHICLE, ROLES) if not (folder / name).exists()
    ]
    if missing:
        raise InputError(
            "this is not the run folder of a trial",
            where=str(folder),
            expected=", ".join((DESCRIPTION, TRIAL, VEHICLE, ROLES)),
            found=f"no {', '.join(missing)}",
            remedy="give a folder that `slipbench trial` or `slipbench session` made",
        )
    description, binding = load_toml(folder / DESCRIPTION), _binding(folder)
    trial = read_toml(folder / TRIAL, TrialFile, recorded=True)
    trial = degraded_trial(trial, binding, binding.codec())
    controller = folder / CONTROLLER
    plan = plan_of(
        trial,
        plan_excitation(trial, str(folder / TRIAL)),
        read_toml(controller, ControllerFile) if controller.exists() else None,
    )
    wheels = wheels_of(read_vehicle(folder / VEHICLE))
    buses = _bus_names(description)
    return RecordedTrial(folder, plan, binding, wheels, buses, _bitrate(description))


def _binding(folder: Path) -> Binding:
    """Binding of the copied database: the bench's own, or that of the copied binding file."""
    path = folder / ROLES
    roles = read_toml(path, RoleMap)
    database = load_database(find_database(folder), roles.bus_of)
    if {message.name for message in database.messages} >= OWN_MESSAGES:
        return own_binding(database)
    return bind(roles, database, path)


def _bus_names(description: dict[str, Any]) -> tuple[str, ...]:
    several = description.get("buses")
    return tuple(several) if several else (str(description["bus"]["name"]),)


def _bitrate(description: dict[str, Any]) -> float:
    return float(description.get("bus", {}).get("bitrate", 0.0))

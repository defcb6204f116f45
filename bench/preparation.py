"""Before a trial: every file is read, every check made, and only then the run folder begun."""

from dataclasses import dataclass
from pathlib import Path

from bench.excitation import plan_excitation
from bench.trial import Plan, plan_of
from bench.virtual_motorcycle import Ride, read_vehicle
from protocol.configuration import read_toml
from protocol.database import load_database
from protocol.errors import InputError
from protocol.layout import Database
from protocol.trial_file import TrialFile


@dataclass(frozen=True)
class Prepared:
    """A trial that can be run, and where its files came from."""

    plan: Plan
    ride: Ride
    database: Database
    trial_path: Path
    vehicle_path: Path
    database_path: Path

    @property
    def trial(self) -> TrialFile:
        """The trial file as read."""
        return self.plan.trial


def prepare(trial_path: Path, database_path: Path) -> Prepared:
    """Read and check a trial; raises InputError for whatever the user must mend."""
    trial = read_toml(trial_path, TrialFile)
    vehicle_path = (trial_path.parent / trial.vehicle).resolve()
    return Prepared(
        plan_of(trial, plan_excitation(trial)),
        Ride(read_vehicle(vehicle_path), trial),
        load_database(database_path),
        trial_path,
        vehicle_path,
        database_path,
    )


def check_swing(prepared: Prepared, opening: float) -> None:
    """Refuse a throttle excitation that would leave the range around `opening` (0..1)."""
    if prepared.plan.excitation.actuator != "throttle":
        return
    low, high = prepared.trial.limits.throttle
    swing = float(abs(prepared.plan.excitation.table).max())
    if low <= opening - swing and opening + swing <= high:
        return
    raise InputError(
        "the excitation would leave the throttle's range",
        where=str(prepared.trial_path),
        expected=f"{low:.1%} .. {high:.1%} (limits.throttle)",
        found=f"{swing:.1%} about the {opening:.1%} that holds the operating point",
        remedy="lower excitation.amplitude or choose another operating point",
    )

"""Runs of a session in which something goes wrong: recorded into its folder before the session runs.

The folder of a session is its state, so the session finds them as attempts that it has to look at.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from slipbench.bench.bus.faults import NO_FAULTS, FaultPlan, Lost, Where
from slipbench.bench.session.session import Session, open_session
from slipbench.bench.session.session_folder import attempt_path, locked
from slipbench.bench.trials.preparation import Prepared, prepare
from slipbench.bench.trials.run import begin_run, end_run
from slipbench.bench.trials.simulated_trial import simulated_trial
from slipbench.plant.vehicle_file import Vehicle

SILENT_FROM = 8.0  # s since the trial's script began: in the middle of the excitation
SOFT = 0.55  # of the stiffness of the tyre: it has lost air


@dataclass(frozen=True)
class Mishap:
    """Faults of one run. run: its name; faults: of the bus; changed: vehicle instead."""

    run: str
    text: str
    faults: FaultPlan = NO_FAULTS
    changed: Callable[[Vehicle], Vehicle] = lambda vehicle: vehicle


def silent_sensors(run: str) -> Mishap:
    """The frames of the motorcycle are lost from the middle of the excitation on: the trial trips."""
    lost = Lost(1.0, Where(begin=SILENT_FROM, senders=frozenset({"motorcycle"})))
    return Mishap(run, "a connector comes loose", FaultPlan(seed=1, faults=(lost,)))


def soft_tyre(run: str) -> Mishap:
    """The tyre has lost air: the run differs from the earlier ones."""
    return Mishap(run, "the rear tyre loses air", changed=_softer)


def _softer(vehicle: Vehicle) -> Vehicle:
    bike = vehicle.motorcycle
    tyre = replace(bike.tyre, slip_stiffness=SOFT * bike.tyre.slip_stiffness)
    return replace(vehicle, motorcycle=replace(bike, tyre=tyre))


def record(plan: Path, folder: Path, mishaps: tuple[Mishap, ...]) -> None:
    """Record the first attempts at these runs of a plan into the folder of its session."""
    with locked(folder):
        session = open_session(plan, folder)
        for mishap in mishaps:
            _ride(session, mishap)


def _ride(session: Session, mishap: Mishap) -> None:
    run = next(run for run in session.runs if run.name == mishap.run)
    prepared = _changed(prepare(session.trial_path(run)), mishap)
    path = attempt_path(session.folder, run.name, 1)
    with simulated_trial(prepared, mishap.faults) as trial:
        description = begin_run(prepared, path, None)
        end_run(path, description, trial.run(path), prepared.trial)


def _changed(prepared: Prepared, mishap: Mishap) -> Prepared:
    scenario = prepared.scenario
    return replace(prepared, scenario=replace(scenario, vehicle=mishap.changed(scenario.vehicle)))

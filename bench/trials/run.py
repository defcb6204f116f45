"""A trial and its recording: make the run folder, record, write run.toml."""

import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from slipbench import dbc
from slipbench.bench.bus.opening import RECEIVE_BUFFER, BusAddress
from slipbench.bench.gateway.fail_safe import described
from slipbench.bench.loop.clock import SECOND
from slipbench.bench.loop.ticks import TICKS, read_ticks
from slipbench.bench.safety.trial import TrialState
from slipbench.bench.trials.live_trial import live_trial
from slipbench.bench.trials.outcome import Outcome, outcome_tables
from slipbench.bench.trials.preparation import Prepared, check_amplitude
from slipbench.bench.trials.simulated_trial import BITRATE, START, simulated_names, simulated_trial
from slipbench.bench.trials.vehicle_roles import roles_text
from slipbench.bench.vehicle.live_vehicle import VehicleProcess
from slipbench.bench.vehicle.virtual_motorcycle import equilibrium_throttle, wheels_of
from slipbench.protocol.codec.messages import Phase
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.database_copy import copy_database
from slipbench.protocol.recording.run_folder import DESCRIPTION, create, versions, write_description
from slipbench.protocol.recording.tags import TAGS, tags_of
from slipbench.protocol.trial_file import TrialFile


def run_trial(
    prepared: Prepared,
    folder: Path,
    addresses: Sequence[BusAddress] | None,
    progress: Callable[[float], None] = lambda _: None,
    phases: Callable[[Phase], None] = lambda _: None,
    vehicle: VehicleProcess | None = None,
) -> Outcome:
    """Outcome of a trial, recorded in `folder`: on the simulated clock, or in real time.

    addresses: of the buses, in the order of the binding; None: on the simulated clock
    progress: receives the seconds of the trial's script that are over; phases: receives each phase as it
    begins; vehicle: process of the virtual motorcycle, with which the trial ends.

    Raises InputError, and leaves no folder behind, where the folder exists, the trial does not suit
    the vehicle or the database, or the bus cannot be opened.
    """
    if addresses is None:
        check_amplitude(prepared, equilibrium_throttle(prepared.scenario))
        with simulated_trial(prepared) as trial:
            description = begin_run(prepared, folder, None)
            with _failure_described(folder, description, prepared.trial):
                outcome = trial.run(folder, progress, phases)
        return end_run(folder, description, outcome, prepared.trial)
    with live_trial(prepared, addresses, vehicle) as loop:
        description = begin_run(prepared, folder, addresses, loop.receive_buffer)
        with _failure_described(folder, description, prepared.trial):
            outcome = loop.run(folder, phases, progress)
        # Here, where Ctrl-C has no effect.
        return end_run(folder, description, outcome, prepared.trial)


@contextmanager
def _failure_described(
    folder: Path, description: dict[str, Any], trial: TrialFile
) -> Iterator[None]:
    """Write the outcome of a trial that an exception ends, then raise the exception again."""
    try:
        yield
    except (Exception, KeyboardInterrupt) as fault:
        lateness = read_ticks(folder / TICKS, round(trial.command.period * SECOND))
        why = f"the trial ended with an exception: {described(fault)}"
        end_run(folder, description, Outcome(TrialState(), (), lateness, died=why), trial)
        raise


def begin_run(
    prepared: Prepared,
    folder: Path,
    addresses: Sequence[BusAddress] | None,
    room: int | None = None,
) -> dict[str, Any]:
    """Description of a run; makes its folder with all that is known before the trial, or no folder.

    room: size in bytes of the receive buffer of the kernel, where it was set. Raises InputError where
    the folder exists or cannot be written.
    """
    create(folder)
    description = _description(prepared, addresses, room)
    try:
        _keep_inputs(prepared, folder)
        write_description(folder, description)
    except OSError as cause:
        shutil.rmtree(folder, ignore_errors=True)
        raise InputError(
            "the recording cannot be begun",
            where=str(folder),
            found=str(cause.strerror or cause),
            remedy="make room, or give a folder on another disk with --out",
        ) from cause
    return description


def end_run(
    folder: Path, description: dict[str, Any], outcome: Outcome, trial: TrialFile
) -> Outcome:
    """Outcome after it was written into run.toml; a full disk is a note and costs no frame.

    Tags that were written while the trial ran stay.
    """
    known = {**description, **_tags_since(folder), **outcome_tables(outcome, trial)}
    try:
        write_description(folder, known)
    except OSError as cause:
        note = f"run.toml has no outcome of the trial: {cause.strerror}"
        return replace(outcome, notes=(*outcome.notes, note))
    return outcome


def _tags_since(folder: Path) -> dict[str, Any]:
    """Table [tags] of run.toml as it is now, for the description; nothing where it has none."""
    try:
        description = load_toml(folder / DESCRIPTION)
        return {TAGS: description[TAGS]} if tags_of(description, DESCRIPTION) else {}
    except InputError:  # being edited: the trial's end must be recorded all the same
        return {}


def _keep_inputs(prepared: Prepared, folder: Path) -> None:
    """Copy the files of the trial, so that the folder alone is enough to repeat an analysis."""
    shutil.copyfile(prepared.trial_path, folder / "trial.toml")
    shutil.copyfile(prepared.vehicle_path, folder / "vehicle.toml")
    copy_database(prepared.database_path, folder)
    if prepared.controller_path:
        shutil.copyfile(prepared.controller_path, folder / "controller.toml")
    (folder / "roles.toml").write_text(
        roles_text(
            prepared.binding.path or dbc.MOTORBIKE_ROLES, wheels_of(prepared.scenario.vehicle)
        )
    )


def _description(
    prepared: Prepared, addresses: Sequence[BusAddress] | None, room: int | None
) -> dict[str, Any]:
    """Description of the run before it begins, so that a killed one is described as well.

    room: size in bytes of the receive buffer of the kernel, where it was set.
    """
    run: dict[str, Any] = {
        "kind": "trial",
        "name": prepared.trial.name,
        "vehicle": prepared.scenario.vehicle.name,
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "database_sha256": prepared.database.sha256,
    }
    if addresses is None:
        run["start_time_ns"] = START
        bus = {"interface": "simulated", "bitrate": BITRATE, "clock": "simulated"}
        each = [{"name": name} for name in simulated_names(prepared.binding)]
    else:
        bus = {
            "interface": addresses[0].interface,
            "bitrate": addresses[0].bitrate,
            "clock": "monotonic",
        }
        each = [{"channel": address.channel, "name": address.name} for address in addresses]
        if room is not None:
            bus["receive_buffer"], bus["receive_buffer_wanted"] = room, RECEIVE_BUFFER
    if len(each) == 1:
        bus |= each[0]
    described: dict[str, Any] = {"run": run, "bus": bus, "versions": versions()}
    if len(each) > 1:
        described["buses"] = {of_bus.pop("name"): of_bus for of_bus in each}
    if prepared.tags:
        described[TAGS] = dict(prepared.tags)
    if prepared.degraded:
        described["warnings"] = [f"degraded mode: {text}" for text in prepared.degraded]
    return described

"""Before a trial: every file is read and checked before the run folder exists."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from slipbench import dbc
from slipbench.bench.loop.loop import LAST_TICK, MOST_TICKS
from slipbench.bench.safety.trial import Plan, plan_of
from slipbench.bench.trials.degraded import degraded_trial, modes
from slipbench.bench.trials.excitation import plan_excitation
from slipbench.bench.trials.wire_limits import check_authority, check_wire
from slipbench.bench.vehicle.virtual_motorcycle import Scenario, read_vehicle
from slipbench.protocol.binding.binding import Binding, own_binding, read_binding
from slipbench.protocol.configuration import read_toml
from slipbench.protocol.controller_file import Bounds, ControllerFile
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Database
from slipbench.protocol.errors import InputError
from slipbench.protocol.quantity import shown
from slipbench.protocol.shipped_files import file_or_shipped
from slipbench.protocol.trial_file import TrialFile


@dataclass(frozen=True)
class Prepared:
    """A trial that can be run, and the paths of its files.

    degraded: what the bus lacks, and what the bench does instead
    tags: of the run, for run.toml
    """

    plan: Plan
    scenario: Scenario
    binding: Binding
    trial_path: Path
    vehicle_path: Path
    database_path: Path
    controller_path: Path | None = None
    degraded: tuple[str, ...] = ()
    tags: Mapping[str, int | float | str] = field(default_factory=dict)

    @property
    def database(self) -> Database:
        """Database of the bus, with the protections of the binding."""
        return self.binding.database

    @property
    def trial(self) -> TrialFile:
        """The trial file as read."""
        return self.plan.trial


def prepare(
    trial_path: Path, database_path: Path | None = None, binding_path: Path | None = None
) -> Prepared:
    """Files of a trial, read and checked. Raises InputError for every input error.

    database_path  of the bench's own database, or in place of the one that the binding names
    binding_path   of a binding to another database
    """
    binding, database_path = _binding(binding_path, database_path)
    codec = binding.codec()
    trial = read_toml(trial_path, TrialFile)
    controller_path = _controller_path(trial, trial_path)
    controller = read_toml(controller_path, ControllerFile) if controller_path else None
    binding.require_trial(spark=_moves_spark(trial, controller))
    degraded = tuple(mode.text for mode in modes(binding, codec, trial))
    trial = degraded_trial(trial, binding, codec)
    vehicle_path = file_or_shipped(trial.vehicle, "vehicle", folder=trial_path.parent).resolve()
    if controller:
        check_controller(controller, trial, str(controller_path))
    _check_length(trial, str(trial_path))
    excitation = plan_excitation(trial, str(trial_path))
    check_wire(trial, excitation, codec, str(trial_path))
    plan = plan_of(trial, excitation, controller)
    check_authority(plan.authority, codec, str(trial_path))
    return Prepared(
        plan,
        Scenario(read_vehicle(vehicle_path), trial),
        binding,
        trial_path,
        vehicle_path,
        database_path,
        controller_path,
        degraded,
    )


def _binding(path: Path | None, database_path: Path | None) -> tuple[Binding, Path]:
    """Binding of a trial and the path of its database; without a file the bench's own."""
    if path is None:
        own = database_path or dbc.MOTORBIKE
        return own_binding(load_database(own)), own
    binding = read_binding(path, database_path)
    return binding, Path(binding.database.origin)


def _moves_spark(trial: TrialFile, controller: ControllerFile | None) -> bool:
    if controller is None:
        return trial.excitation.actuator == "spark"
    return controller.actuator != "throttle"


def _check_length(trial: TrialFile, where: str) -> None:
    """Refuse a trial with more ticks than the loop can count."""
    least = trial.operating_point.steady_for + trial.settling + trial.hand_back
    longest = LAST_TICK * trial.command.period
    if least + trial.excitation.duration <= longest:
        return
    raise InputError(
        f"the trial has more than the {MOST_TICKS} ticks that the loop can count",
        where=where,
        expected=f"up to {shown(longest, trial.excitation.duration)} of operating_point.steady_for, excitation.duration, "
        "settling and hand_back together",
        found=shown(least + trial.excitation.duration, trial.excitation.duration),
        remedy="shorten excitation.duration, make two trials of it, or lengthen command.period",
    )


def _controller_path(trial: TrialFile, trial_path: Path) -> Path | None:
    if not trial.controller:
        return None
    return file_or_shipped(trial.controller.file, "controller", folder=trial_path.parent).resolve()


def check_controller(controller: ControllerFile, trial: TrialFile, where: str) -> None:
    """Check a controller against a trial. Raises InputError where its period or its limits do not suit."""
    limits, period = trial.limits, trial.command.period
    if abs(controller.period - period) > 1e-9:
        raise InputError(
            "the controller was designed for another command period",
            where=where,
            expected=f"{period} (command.period)",
            found=shown(controller.period, period),
            remedy="design it again, or change command.period",
        )
    deviation = limits.throttle_deviation
    throttle = controller.mixed.throttle if controller.mixed else controller.limits
    spark = controller.limits if controller.actuator != "throttle" else None
    if controller.actuator != "spark":
        _inside(throttle, (-deviation, deviation), limits.throttle_rate, "throttle", where)
    if spark is not None:
        _inside(spark, limits.spark, limits.spark_rate, "spark", where)
    _check_ramps(controller, trial, where)


def _inside(
    bounds: Bounds, allowed: tuple[float, float], rate: float, actuator: str, where: str
) -> None:
    low, high = allowed
    if low <= bounds.low and bounds.high <= high and bounds.rate <= rate:
        return
    raise InputError(
        f"the controller may move the {actuator} further or faster than the trial permits",
        where=where,
        expected=f"{shown(low, high)} .. {high} at up to {rate} (the trial's limits)",
        found=f"{shown(bounds.low, high)} .. {shown(bounds.high, high)}"
        f" at up to {shown(bounds.rate, rate)}",
        remedy="design it for these limits, or narrow its limits",
    )


def _check_ramps(controller: ControllerFile, trial: TrialFile, where: str) -> None:
    """Refuse a hand-back that could be faster than the rate limits."""
    limits = trial.limits
    throttle = controller.mixed.throttle if controller.mixed else controller.limits
    ramps = []
    if controller.actuator != "spark":
        # the rider's grip may request the other end of the permitted range
        distance = _largest(throttle) + limits.throttle_deviation
        ramps.append(("throttle", distance, limits.throttle_rate))
    if controller.actuator != "throttle":
        ramps.append(("spark", _largest(controller.limits), limits.spark_rate))
    for actuator, distance, rate in ramps:
        if distance > rate * trial.hand_back:
            least = shown(distance / rate, trial.hand_back)
            raise InputError(
                f"the hand-back could move the {actuator} faster than the trial permits",
                where=where,
                expected=f"up to {rate} (limits.{actuator}_rate)",
                found=f"{shown(distance / trial.hand_back, rate)} within hand_back = {trial.hand_back}",
                remedy=f"lengthen hand_back to {least}",
            )


def _largest(bounds: Bounds) -> float:
    return max(abs(bounds.low), abs(bounds.high))


def check_amplitude(prepared: Prepared, opening: float) -> None:
    """Check the range of the throttle about `opening` (0..1). Raises InputError where it is exceeded."""
    if prepared.plan.excitation.actuator != "throttle":
        return
    low, high = prepared.trial.limits.throttle
    amplitude = float(abs(prepared.plan.excitation.table).max())
    if low <= opening - amplitude and opening + amplitude <= high:
        return
    raise InputError(
        "the excitation would leave the throttle's range",
        where=str(prepared.trial_path),
        expected=f"{low:.1%} .. {high:.1%} (limits.throttle)",
        found=f"{amplitude:.1%} about the {opening:.1%} that holds the operating point",
        remedy="lower excitation.amplitude or choose another operating point",
    )

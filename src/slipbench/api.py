"""The functions that `import slipbench` offers, and Trial; docs/api.md shows how to use them.

Every file may be given as text or as a Path. Each function imports what it needs when it is called.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, overload

from slipbench import dbc
from slipbench.protocol.recording.recording import Recording

if TYPE_CHECKING:
    import numpy.typing as npt

    from slipbench.bench.trials.outcome import Outcome
    from slipbench.controllers.slip_controller import SlipController
    from slipbench.identification.mismatch.callables.call import Simulate
    from slipbench.identification.mismatch.callables.parameter import Parameter
    from slipbench.identification.mismatch.reporting.verdict import Verdict
    from slipbench.identification.models.study import Study
    from slipbench.identification.response.identify import Identification
    from slipbench.plant.vehicle_file import Vehicle
    from slipbench.protocol.controller_file import ControllerFile
    from slipbench.protocol.database.layout import Database
    from slipbench.protocol.export import Exported
    from slipbench.protocol.trial_file import TrialFile

StrPath = str | Path
Actuator = Literal["throttle", "spark", "mixed"]
ControlLaw = Literal["best", "pid", "internal_model", "h_infinity"]


class Trial:
    """A trial file that was read and checked, with its vehicle, controller and database."""

    def __init__(self, file: StrPath, database: StrPath = dbc.MOTORBIKE) -> None:
        """Read and check the files. Raises InputError where one of them is invalid."""
        from slipbench.bench.trials.preparation import prepare

        self._prepared = prepare(Path(file), Path(database))

    @property
    def file(self) -> "TrialFile":
        """The trial file as read; quantities in SI."""
        return self._prepared.trial

    @property
    def name(self) -> str:
        """Name of the trial."""
        return self.file.name

    def run(
        self,
        out: StrPath,
        *,
        interface: str | None = None,
        channel: str = "can0",
        bitrate: int = 1_000_000,
        fd: bool = False,
        progress: Callable[[float], None] | None = None,
    ) -> "Outcome":
        """Run the trial, record it in the new run folder `out` and return its outcome.

        Without `interface` the virtual motorcycle runs on the simulated clock. With a python-can
        `interface` and `channel` the trial runs in real time on that bus; bitrate in bit/s.
        `progress` is called with the simulated time in s. Raises InputError where the folder
        exists, the trial does not suit the vehicle, or the bus cannot be opened.
        """
        from slipbench.bench.bus.opening import BusAddress
        from slipbench.bench.trials.run import run_trial

        addresses = None if interface is None else [BusAddress(interface, channel, bitrate, fd)]
        return run_trial(self._prepared, Path(out), addresses, progress or _ignore)

    def __repr__(self) -> str:
        return f"<Trial {self.name}: {self.file.description}>"


def read(folder: StrPath) -> Recording:
    """Read the recording in a run folder, or in a file with a table whose titles state units.

    Raises InputError where it is missing or damaged.
    """
    from slipbench.protocol.recording.table_recording import read_recording

    return read_recording(Path(folder))


def import_log(
    log: StrPath,
    roles: StrPath,
    out: StrPath,
    database: StrPath | None = None,
    tables: Mapping[str, StrPath] | None = None,
) -> Recording:
    """Import a log or a table as a recording in the new run folder `out`, and read it.

    roles: role map (TOML). database: not needed for a table. tables: side tables by the names that
    the role map uses. Raises InputError where a file is invalid or `out` exists.
    """
    from slipbench.protocol.recording.import_log import Capture, import_capture

    side = {name: Path(path) for name, path in (tables or {}).items()}
    known = None if database is None else Path(database)
    return import_capture(Capture(Path(log), Path(roles), known, side), Path(out))


def export(run: StrPath | Recording, form: str, out: StrPath | None = None) -> "Exported":
    """Write a recording as "mf4", "blf", "asc", "parquet" or "mcap"; return what was written.

    out: new file, for Parquet a new folder; None: in the run folder. Raises InputError where the
    recording cannot be read, the format is unknown, or `out` exists.
    """
    from slipbench.protocol.export import export_run

    return export_run(_folder(run), form, None if out is None else Path(out))


def load_database(file: StrPath = dbc.MOTORBIKE) -> "Database":
    """Read a DBC file; without a name, the bench's own. Raises InputError where it is invalid."""
    from slipbench.protocol.database.database import load_database as load

    return load(Path(file))


def load_vehicle(file: StrPath) -> "Vehicle":
    """Read a vehicle file (TOML). Raises InputError where it is invalid."""
    from slipbench.bench.vehicle.virtual_motorcycle import read_vehicle

    return read_vehicle(Path(file))


def load_controller(file: StrPath) -> "SlipController":
    """Read a controller file (TOML), as `design` makes it. Raises InputError where it is invalid."""
    from slipbench.controllers.slip_controller import from_tree
    from slipbench.protocol.configuration import read_toml
    from slipbench.protocol.controller_file import ControllerFile

    return from_tree(read_toml(Path(file), ControllerFile).model_dump())


def identify(
    run: StrPath | Recording,
    *,
    window: tuple[float, float] | None = None,
    input: str | None = None,
    output: str | None = None,
) -> "Identification":
    """Identify a recording: slip, frequency responses, resonance, spectra.

    window: start and end of the part to identify from, s after the recording's start; None: the
    excitation of the trial. input, output: signals; None: the actuator of the trial, and slip.
    What the recording does not support is listed in `left_out` with the reason. Raises InputError
    where the recording has no samples, the trial tripped before its excitation, or there is no
    such window or signal.
    """
    from slipbench.identification.response.from_folder import identified
    from slipbench.identification.response.selection import Selection

    recording = run if isinstance(run, Recording) else read(run)
    return identified(recording, Selection(window, input, output))


def fit_models(identification: "Identification") -> "Study":
    """Fit rational models with dead time to the responses of slip, or of the selected output.

    After a sweep also the harmonics of slip.
    """
    from slipbench.identification.models.study import study_of

    return study_of(identification)


@overload
def explain(
    vehicle: StrPath,
    training: Sequence[StrPath | Recording],
    held_out: Sequence[StrPath | Recording] = (),
    progress: Callable[[str], None] | None = None,
    *,
    check: int = 0,
) -> "Verdict": ...
@overload
def explain(
    simulate: "Simulate",
    parameters: "Mapping[str, Parameter]",
    recordings: Sequence[StrPath | Recording],
    held_out: Sequence[StrPath | Recording] = (),
    progress: Callable[[str], None] | None = None,
    *,
    inputs: Sequence[str],
    outputs: Sequence[str],
    linear: Sequence[str] = (),
    speeds: Mapping[str, str] | None = None,
    period: float = 0.0,
    improved: StrPath | None = None,
    time_limit: float | None = 60.0,
    check: int = 0,
) -> "Verdict": ...
def explain(*arguments: Any, **options: Any) -> "Verdict":
    """Explain where a simulation and recordings differ: place, effect, significance.

    vehicle: vehicle file or model file (TOML). training (recordings), held_out: run folders or
    recordings; "run@0:60" is the part from 0 to 60 s. `progress` is called with each step's
    description. check: number of simulated sets of recordings that are analysed to check how
    repeatable the verdict is, and as many without effects; it takes twice as many analyses.

    simulate: a function `simulate(parameters, inputs, times)` that returns outputs. It gets a
    dictionary of numbers in the units of `parameters`, arrays (n,) of the inputs in the unit
    recorded (SI) and evenly spaced times (n,) in s from 0, and returns arrays (n,) of the outputs
    at these times. inputs, outputs: roles of the recordings. An input holds until the next sample;
    those in `linear` follow straight lines. speeds: input -> output that is the speed of what it
    drives: friction may act along it. period: of the bins in which residuals are tested, s;
    that of the slowest output if 0. improved: new file (TOML) with the calibrated parameters and
    the effects that were found. time_limit: of one run, s; on Linux the function runs in a
    process of its own, and one that hangs or crashes does not end the analysis. None: in this
    process, without limit.

    After Ctrl-C the result so far is returned with `complete` False. Raises InputError where the
    files or recordings do not belong together, or a function cannot be used.
    """
    first = arguments[0] if arguments else options.get("simulate", options.get("vehicle"))
    how = _explain_function if callable(first) else _explain_file
    verdict: Verdict = how(*arguments, **options)
    return verdict


def _explain_file(
    vehicle: StrPath,
    training: Sequence[StrPath | Recording],
    held_out: Sequence[StrPath | Recording] = (),
    progress: Callable[[str], None] | None = None,
    *,
    check: int = 0,
) -> "Verdict":
    from slipbench.identification.mismatch.explain import run_analysis
    from slipbench.identification.mismatch.predictive_check.check import checked
    from slipbench.identification.mismatch.runs import open_analysis

    folders = [[_folder(run) for run in runs] for runs in (training, held_out)]
    analysis = open_analysis(Path(vehicle), *folders)
    run_analysis(analysis, progress or _ignore)
    return checked(analysis, check, progress or _ignore)


def _explain_function(
    simulate: "Simulate",
    parameters: "Mapping[str, Parameter]",
    recordings: Sequence[StrPath | Recording],
    held_out: Sequence[StrPath | Recording] = (),
    progress: Callable[[str], None] | None = None,
    *,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    linear: Sequence[str] = (),
    speeds: Mapping[str, str] | None = None,
    period: float = 0.0,
    improved: StrPath | None = None,
    time_limit: float | None = 60.0,
    check: int = 0,
) -> "Verdict":
    from slipbench.identification.mismatch.callables.description import Ports
    from slipbench.identification.mismatch.callables.function_system import function_system
    from slipbench.identification.mismatch.explain import run_analysis
    from slipbench.identification.mismatch.predictive_check.check import checked
    from slipbench.identification.mismatch.reporting.output import write_improved
    from slipbench.identification.mismatch.runs import analysis_of

    ports = Ports(tuple(inputs), tuple(outputs), tuple(linear), period, dict(speeds or {}))
    training, proof = ([_in_memory(run) for run in runs] for runs in (recordings, held_out))
    system = function_system(simulate, parameters, ports, training, time_limit)
    analysis = analysis_of(system, training, proof)
    run_analysis(analysis, progress or _ignore)
    if improved is not None:
        write_improved(analysis, Path(improved))
    return checked(analysis, check, progress or _ignore)


def recording_of(
    name: str,
    time: "npt.ArrayLike",
    values: "Mapping[str, npt.ArrayLike]",
    units: Mapping[str, str],
) -> Recording:
    """Make a recording of arrays that were measured together.

    time: (n,) s, increasing. values: role -> (n,), in the unit that `units` states for it; the
    recording holds SI. Raises InputError where an array or a unit cannot be used.
    """
    from slipbench.protocol.recording.from_arrays import recording_of as of_arrays

    return of_arrays(name, time, values, units)


def design(
    runs: Sequence[StrPath | Recording],
    actuator: Actuator,
    out: StrPath,
    *,
    law: ControlLaw = "best",
    gain_margin: float = 6.0,
    phase_margin: float = 40.0,
    sensitivity: float = 2.0,
    period: float = 1.0,
) -> "ControllerFile":
    """Design a slip controller on recorded trials and write it to the controller file `out`.

    The first run is the nominal one; the loop keeps its margins for every run of the actuator.
    gain_margin: dB; phase_margin: deg; sensitivity: greatest peak of S; period: ms. The margins of
    the design are in `designed` of the returned file. Raises InputError where a run cannot be
    read, the margins are impossible, or no controller keeps them.
    """
    from slipbench.identification.design.controller_design import (
        Specification,
        design_controller,
        required_margins,
    )
    from slipbench.protocol.controller_file import write_controller

    required = required_margins(gain_margin, phase_margin, sensitivity)
    specification = Specification(actuator, required, law, period * 1e-3)
    specification.check()
    file = design_controller([identify(run) for run in runs], specification).file
    write_controller(file, Path(out))
    return file


def replay(
    log: StrPath,
    interface: str,
    channels: Sequence[str] = ("can0",),
    *,
    speed: float = 1.0,
    passes: int = 1,
    bitrate: int = 1_000_000,
    fd: bool = False,
) -> dict[str, Any]:
    """Send a log's frames at their recorded times, in a process of its own; return the timing.

    channels: the interface's channel, or "LOGBUS=CHANNEL" for each bus; bitrate: bit/s. In a
    script, call it below `if __name__ == "__main__":`. The result holds the frames sent and the
    quantiles of their lateness in s. Raises InputError where the log or a bus cannot be used.
    """
    from slipbench.bench.replay.replay_process import ReplayOrder, running_replay
    from slipbench.bench.replay.replay_report import timing

    order = ReplayOrder(Path(log), interface, tuple(channels), (), "", "", bitrate, fd)
    with running_replay(order, speed, passes) as running:
        running.begin()
        while (done := running.report(within=1.0)) is None:
            pass
        return timing(running.ready, done)


def _folder(run: StrPath | Recording) -> Path:
    return run.folder if isinstance(run, Recording) else Path(run)


def _in_memory(run: StrPath | Recording) -> Recording:
    from slipbench.identification.mismatch.simulation.piece import Piece

    return run if isinstance(run, Recording) else Piece.of(Path(run)).read()


def _ignore(_: object) -> None:
    """Show no progress."""

"""The sub-commands for logs, captures and databases: decode, export, import, roles, bind."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from slipbench.protocol.errors import InputError
from slipbench.protocol.shipped_files import completion_of, file_of

if TYPE_CHECKING:
    from collections.abc import Callable

Logs = Annotated[
    list[Path], typer.Argument(metavar="LOG", help="Recognized by content, not by the ending.")
]
OneDatabase = Annotated[
    Path,
    typer.Option(
        "--dbc",
        help="The vehicle's CAN database: DBC, ARXML, KCD or SYM.",
        metavar="FILE",
        parser=file_of("database"),
        autocompletion=completion_of("database"),
    ),
]


def register(app: typer.Typer) -> None:
    """Add these commands to the one command."""
    app.command("decode")(decode)
    app.command("export")(export)
    app.command("import")(import_)
    app.command("roles")(roles_)
    app.command("bind")(bind)


def decode(
    log: Logs,
    database: OneDatabase,
    out: Annotated[Path, typer.Option(help="New file, .parquet or .csv.")],
    signals: Annotated[
        str,
        typer.Option(
            help='Only these signals: "Message", "Message.signal" or "signal", separated by commas.'
        ),
    ] = "",
) -> None:
    """Decode a log to one long table: every signal of every message in the database.

    One row per sample, with the columns time (s since the first frame), time_ns (as logged), bus,
    message, signal, value (in the database's unit), unit and label (the value's name, if it has
    one). No whole number is rounded: CSV has every digit; Parquet has a double in value, and the
    digits as text in the column exact where a double would round (value is empty there). In Parquet
    each signal is a row group of its own. To get one signal in pandas:

      df = pd.read_parquet("drive.parquet", filters=[("signal", "==", "RPM")])

    Frames that are not in the database, and frames shorter than their message, are counted
    and listed. A log that breaks off or is out of order is read as far as possible, with a warning.

    Exit status: 0 done, 2 invalid input (see message).

    Examples:

      slipbench decode drive.log --dbc car.dbc --out drive.parquet

      slipbench decode drive.asc --dbc car.dbc --out wheels.csv --signals WheelSpeeds,Engine.RPM
    """
    from slipbench.protocol.database.database import load_database
    from slipbench.protocol.logs.decode_file import decode_file
    from slipbench.protocol.logs.sample_table import chosen
    from slipbench.protocol.recording.summary import decoded

    known = load_database(database)
    selected = chosen(known, [name.strip() for name in signals.split(",") if name.strip()])
    with _progress(f"decoding {_one(log).name}") as progress:
        text, tally, samples = decode_file(_one(log), known, selected, out, progress=progress)
    decoded(text.format, text.warnings, tally, samples, out)


def export(
    run: Annotated[Path, typer.Argument(help="Run folder of a recording.")],
    form: Annotated[str, typer.Option("--format", help="mf4, blf, asc, parquet or mcap.")],
    out: Annotated[
        Path | None, typer.Option(help="New file, for parquet a folder.  [default: in RUN]")
    ] = None,
) -> None:
    """Write a recording in a format that other programs read.

    MF4, MCAP and Parquet hold the raw frames and every decoded signal; Vector's BLF and ASC hold raw
    frames only. Frames keep their order, bus, direction and time, to the nanosecond in MF4 (up to
    one day), BLF, MCAP and Parquet; in ASC to the resolution of the recording.

    Exit status: 0 done, 2 invalid input (see message); then no file is written.

    Examples:

      slipbench export runs/throttle_sweep-001 --format mf4

      slipbench export runs/throttle_sweep-001 --format parquet --out tables
    """
    from slipbench.protocol.export import export_run

    with _progress(f"writing {form}") as progress:
        done = export_run(run, form, out, progress)
    for warning in done.warnings:
        typer.echo(f"warning: {warning}", err=True)
    decoded = f" and {done.samples} decoded samples" if done.samples else ""
    typer.echo(f"{done.frames} frames{decoded} in {done.path}")


def import_(
    log: Logs,
    roles: Annotated[
        Path,
        typer.Option(
            help="Role map (TOML): which signal has which role.",
            metavar="FILE",
            parser=file_of("role map"),
            autocompletion=completion_of("role map"),
        ),
    ],
    out: Annotated[Path, typer.Option(help="New run folder.")],
    database: Annotated[
        Path | None,
        typer.Option(
            "--dbc",
            help="The vehicle's CAN database (not for a table).",
            metavar="FILE",
            parser=file_of("database"),
            autocompletion=completion_of("database"),
        ),
    ] = None,
    table: Annotated[
        list[str] | None, typer.Option(metavar="NAME=FILE", help="Side table; may be repeated.")
    ] = None,
) -> None:
    """Import a capture as a recording that `slipbench identify` reads.

    LOG is a log of frames (candump, Vector ASC and BLF, PCAN TRC, python-can CSV, GVRET CSV, ASAM
    MF4), or a table in place of one (CSV of any logger, exports of MoTeC i2 and AiM RaceStudio,
    RaceLogic VBO, GPX, FIT, MCAP, bags of ROS 1 and 2, Parquet, MF4 of decoded channels), recognized
    by its content; how a table was read is printed. All frames are kept, also those with unknown
    identifiers, with the database, the role map and the side tables in one new folder; the frames are
    decoded again whenever it is read. Roles without samples are listed with the reason. `slipbench
    roles` proposes the role map.

    Exit status: 0 done, 2 invalid input (see message); then no file is written.

    Examples:

      slipbench import drive.log --dbc car.dbc --roles examples/roles/subaru_wrx.toml --out runs/wrx

      slipbench import session.log --dbc r1.dbc --roles examples/roles/yamaha_r1.toml \\
        --table gps=gps.csv --table lean=lean.csv --out runs/r1

      slipbench import logger.csv --roles my_roles.toml --out runs/logger
    """
    from slipbench.protocol.recording.import_log import Capture, import_capture
    from slipbench.protocol.recording.summary import imported

    capture = Capture(_one(log), roles, database, _named(table or []))
    with _progress(f"importing {capture.log.name}") as progress:
        recording = import_capture(capture, out, progress)
    imported(recording)


def roles_(
    log: Logs,
    out: Annotated[
        Path | None, typer.Option(help="New role map (TOML).  [default: LOG's name + _roles.toml]")
    ] = None,
    database: Annotated[
        Path | None,
        typer.Option(
            "--dbc",
            help="The vehicle's CAN database, for a log of frames.",
            metavar="FILE",
            parser=file_of("database"),
            autocompletion=completion_of("database"),
        ),
    ] = None,
    title: Annotated[
        str, typer.Option(help="Name of the recording.  [default: name of the new file]")
    ] = "",
) -> None:
    """Propose a role map for a log: which of its columns or signals has which role, in which unit.

    Columns are found by name (abbreviations of several languages), unit and plausible values. Where
    no unit is stated, one is proposed only if no other is plausible, or if the speed then agrees with
    another one; else the role is listed as unresolved, with the units to choose from. The file has
    the reasons, the range of each column and the next best ones. Read it, and correct it: it is a
    proposal. The next command is printed.

    Exit status: 0 done, 2 invalid input (see message).

    Examples:

      slipbench roles logger.csv

      slipbench roles drive.log --dbc car.dbc --out my_roles.toml
    """
    from slipbench.protocol.role_proposal.wizard import RoleRequest, write_role_map

    one = _one(log)
    request = RoleRequest(one, out or Path(f"{one.stem}_roles.toml"), database, title)
    with _progress(f"reading {one.name}") as progress:
        report = write_role_map(request, progress)
    typer.echo(report)


def bind(
    database: Annotated[
        Path,
        typer.Argument(
            metavar="DATABASE",
            help="The motorcycle's CAN database: DBC, ARXML, KCD or SYM.",
            parser=file_of("database"),
            autocompletion=completion_of("database"),
        ),
    ],
    out: Annotated[Path, typer.Option(help="New binding file (TOML).")],
    log: Annotated[
        Path | None,
        typer.Option(
            help="Capture of this bus: what signals do counts beside their names.",
            metavar="CAPTURE",
        ),
    ] = None,
    title: Annotated[
        str, typer.Option(help="Name of the motorcycle.  [default: name of the new file]")
    ] = "",
) -> None:
    """Propose a binding file: which signal of the motorcycle's bus has which role of the bench.

    Signals are found by name and unit. With a capture also by behaviour: values that a role can have,
    speeds that agree, an engine speed that steps with the gears over the wheel speed; cycle times are
    measured, counters and checksums (AUTOSAR E2E profiles 1, 2, 5; XOR, sum, CRC-8) are searched in
    the payloads. The file names the reasons and the next best signals beside each role. Read it, and
    correct it: it is a proposal. Then see it on the bus with `slipbench check`.

    Exit status: 0 done, 2 invalid input (see message).

    Examples:

      slipbench bind bike.dbc --out my_motorcycle.toml

      slipbench bind bike.dbc --log session.log --out my_motorcycle.toml
    """
    from slipbench.protocol.binding.proposed_file import propose_file, table

    with _progress(f"reading {(log or database).name}") as progress:
        proposal = propose_file(database, log, out, title, progress)
    typer.echo(table(proposal))
    typer.echo(f"{len(proposal.bound)} roles proposed in {out}; read it and confirm them")


def _one(logs: list[Path]) -> Path:
    if len(logs) > 1:
        raise InputError(
            f"{len(logs)} logs at once",
            where=" ".join(map(str, logs)),
            expected="one log: nothing shows that the clocks of several logs agree",
            remedy="if one logger wrote them on one clock, join them as candump text first:"
            " sort -m -n -k1.2,1 A.log B.log > both.log",
        )
    return logs[0]


def _named(tables: list[str]) -> dict[str, Path]:
    """Tables by name, from texts such as "gps=gps.csv". Raises InputError."""
    found: dict[str, Path] = {}
    for text in tables:
        name, equals, file = text.partition("=")
        if not equals or not file or not name.isidentifier() or name in found or name == "main":
            raise InputError(
                f"--table {text!r} is not understood",
                expected="NAME=FILE, each name once, letters, digits and _ only",
                remedy="as in --table gps=gps.csv, with the name that the role map uses",
            )
        found[name] = Path(file)
    return found


@contextmanager
def _progress(what: str) -> "Iterator[Callable[[float], None]]":
    """Progress bar on a terminal; nothing elsewhere."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task(what, total=1.0)
        yield lambda share: bar.update(task, completed=share)

"""The sub-command of this package: export-controller."""

from pathlib import Path
from typing import Annotated

import typer

from slipbench.protocol.shipped_files import completion_of, file_of

EXAMPLE = (
    "Example: slipbench export-controller examples/controllers/throttle.toml --for rusefi"
    " --target 0.03 --out rusefi"
)
DIFFERENT = 3  # exit status


def register(app: typer.Typer) -> None:
    """Add `export-controller` to the one command."""
    app.command("export-controller", epilog=EXAMPLE)(export_controller)


def export_controller(
    controller: Annotated[
        Path,
        typer.Argument(
            help="Controller file.",
            metavar="CONTROLLER",
            parser=file_of("controller"),
            autocompletion=completion_of("controller"),
        ),
    ],
    unit: Annotated[
        str, typer.Option("--for", help="Engine control unit: rusefi.", metavar="UNIT")
    ],
    target: Annotated[float, typer.Option(help="Slip above which torque is reduced: 0.03 is 3 %.")],
    out: Annotated[Path, typer.Option(help="New folder: script, table, README.md.")],
    tick: Annotated[float, typer.Option(help="Ticks of the control unit, Hz, 1 to 200.")] = 200.0,
    table: Annotated[
        str | None,
        typer.Option(
            help="Also a table for rusEFI's own traction control: `subtracted` where the firmware"
            " subtracts its numbers, `added` where it adds them (before the change in 2026).",
            metavar="SIGN",
        ),
    ] = None,
    run: Annotated[
        Path | None,
        typer.Option(
            "--replay", help="Recording to run the script on, beside the controller.", metavar="RUN"
        ),
    ] = None,
) -> None:
    """Export a slip controller to an engine control unit: a Lua script with the discretised law.

    The script only reduces torque. README.md in the folder says how to connect it and what the control
    unit does not carry. With --replay the script is run on a recording, in single precision as on the
    control unit, and its commands are compared with the controller's for the same slip
    (`pip install 'slipbench[ecu]'`).

    Exit status: 0 done, 2 invalid input (see message), 3 script and controller differ on the recording.
    """
    from slipbench.identification.ecu.export import EcuRequest, law_of, write_export
    from slipbench.identification.ecu.replay import replayed_run
    from slipbench.identification.ecu.summary import lines

    request = EcuRequest(controller, unit, target, tick, table, out)
    law = law_of(request)
    done = replayed_run(law, run) if run is not None else None
    for path in write_export(law, request):
        typer.echo(path)
    if done is None:
        return
    typer.echo("\n".join(lines(done)))
    if not done.agrees:
        raise typer.Exit(DIFFERENT)

"""The sub-command of this package: compare."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from slipbench.plant.vehicles import DEMONSTRATION
from slipbench.protocol.shipped_files import completion_of, file_of

if TYPE_CHECKING:
    from slipbench.plant.motorcycle import Motorcycle

EXAMPLE = "Example: slipbench compare examples/controllers/*.toml --page docs/controllers.md"


def register(app: typer.Typer) -> None:
    """Add `compare` to the one command."""
    app.command("compare", epilog=EXAMPLE)(compare_command)


def one_of_each_name(paths: Iterable[Path]) -> list[Path]:
    """Controller files, folders expanded in order. Raises InputError for two of one name."""
    from slipbench.protocol.errors import InputError

    found: dict[str, Path] = {}
    for path in paths:
        files = sorted(path.glob("*.toml")) if path.is_dir() else [path]
        if not files:
            raise InputError(
                "no controller files in this folder",
                where=str(path),
                expected="*.toml",
                found="none",
                remedy="slipbench design RUN... --actuator throttle --out FILE",
            )
        for file in files:
            other = found.setdefault(file.stem, file)
            if other != file:
                raise InputError(
                    "two controller files with the same name",
                    where=str(file),
                    expected="unique file names, which identify the controllers on the page",
                    found=str(other),
                    remedy="rename one of the files",
                )
    return list(found.values())


def compare_command(
    controllers: Annotated[
        list[Path],
        typer.Argument(
            help="Controller files, or folders of them.",
            metavar="FILE",
            parser=file_of("controller"),
            autocompletion=completion_of("controller"),
        ),
    ],
    page: Annotated[Path, typer.Option(help="Page to write (Markdown); figures go to its folder.")],
    vehicle: Annotated[
        Path,
        typer.Option(
            help="Vehicle file to simulate.",
            metavar="FILE",
            parser=file_of("vehicle"),
            autocompletion=completion_of("vehicle"),
        ),
    ] = DEMONSTRATION,
    bandwidth: Annotated[
        float, typer.Option(help="Bandwidth w_c of the throttle servo, Hz.")
    ] = 10.0,
) -> None:
    """Compare slip controllers in closed-loop simulation: the same scenarios for each, and open loop.

    Exit status: 0 done, 2 invalid input (see message).
    """
    from slipbench.identification.closed_loop_simulation.compare import compare
    from slipbench.identification.closed_loop_simulation.page import write_page
    from slipbench.protocol.configuration import read_toml
    from slipbench.protocol.controller_file import ControllerFile
    from slipbench.protocol.output_folders import check_page

    files = {path.stem: read_toml(path, ControllerFile) for path in one_of_each_name(controllers)}
    motorcycle = _motorcycle(vehicle)
    check_page(page)
    with Console(stderr=True).status("") as progress:
        found, rides = compare(motorcycle, files, progress.update)
        write_page(found, rides, page, bandwidth, "make controllers")
    typer.echo(f"page: {page}")


def _motorcycle(vehicle: Path) -> "Motorcycle":
    from slipbench.plant.errors import VehicleFileError
    from slipbench.plant.vehicle_file import load_vehicle
    from slipbench.protocol.errors import InputError

    try:
        return load_vehicle(vehicle).motorcycle
    except VehicleFileError as fault:
        raise InputError(str(fault)) from fault

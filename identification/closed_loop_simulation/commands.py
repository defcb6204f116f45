"""The sub-commands of this package: compare, robustness."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from slipbench.plant.vehicles import DEMONSTRATION, NOMINAL
from slipbench.protocol.shipped_files import completion_of, file_of

if TYPE_CHECKING:
    from slipbench.plant.vehicle_file import Vehicle

EXAMPLE = "Example: slipbench compare examples/controllers/*.toml --page docs/controllers.md"

DRAWN_EXAMPLE = (
    "Example: slipbench robustness examples/controllers --page docs/controller_robustness.md"
)


def register(app: typer.Typer) -> None:
    """Add these commands to the one command."""
    app.command("compare", epilog=EXAMPLE)(compare_command)
    app.command("robustness", epilog=DRAWN_EXAMPLE)(robustness_command)


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


Controllers = Annotated[
    list[Path],
    typer.Argument(
        help="Controller files, or folders of them.",
        metavar="FILE",
        parser=file_of("controller"),
        autocompletion=completion_of("controller"),
    ),
]
VehicleFile = Annotated[
    Path,
    typer.Option(
        help="Vehicle file to simulate.",
        metavar="FILE",
        parser=file_of("vehicle"),
        autocompletion=completion_of("vehicle"),
    ),
]


def compare_command(
    controllers: Controllers,
    page: Annotated[Path, typer.Option(help="Page to write (Markdown); figures go to its folder.")],
    vehicle: VehicleFile = DEMONSTRATION,
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
    motorcycle = _vehicle(vehicle).motorcycle
    check_page(page)
    with Console(stderr=True).status("") as progress:
        found, rides = compare(motorcycle, files, progress.update)
        write_page(found, rides, page, bandwidth, "make controllers")
    typer.echo(f"page: {page}")


def robustness_command(
    controllers: Controllers,
    page: Annotated[Path, typer.Option(help="Page to write (Markdown).")],
    vehicle: VehicleFile = NOMINAL,
    draws: Annotated[int, typer.Option(help="Motorcycles to draw.", min=1)] = 100,
    seed: Annotated[
        int, typer.Option(help="Seed of the draws and of the sensor noise.", min=0)
    ] = 1,
    first: Annotated[int, typer.Option(help="Number of the first motorcycle.", min=1)] = 1,
    limit: Annotated[
        float, typer.Option(help="Slip that a ride must not exceed: 0.08 is 8 %.", min=0.0, max=1.0)
    ] = 0.08,
) -> None:
    """Ride slip controllers on drawn motorcycles: parameters within their stated deviations, with effects.

    The vehicle file must state `plus_minus`. Ctrl-C ends the study; the page then has what was ridden.

    Exit status: 0 done, 2 invalid input (see message).
    """
    from slipbench.identification.closed_loop_simulation.robustness import Outcome, outcomes
    from slipbench.identification.closed_loop_simulation.robustness_page import Study
    from slipbench.identification.closed_loop_simulation.robustness_page import page as text_of
    from slipbench.protocol.configuration import read_toml
    from slipbench.protocol.controller_file import ControllerFile
    from slipbench.protocol.output_folders import check_page

    files = {path.stem: read_toml(path, ControllerFile) for path in one_of_each_name(controllers)}
    known, rows = _vehicle(vehicle), list[Outcome]()
    check_page(page)
    numbers = range(first, first + draws)
    with Console(stderr=True).status("") as progress:
        try:
            for ridden in outcomes(known, files, numbers, seed, progress.update):
                rows += ridden
        except KeyboardInterrupt:
            if not rows:
                raise
    names = " ".join(map(str, controllers))
    command = f"slipbench robustness {names} --draws {draws} --seed {seed}"
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(text_of(Study(known.name, draws, seed, limit, rows, command)), "utf-8")
    typer.echo(f"page: {page}")


def _vehicle(vehicle: Path) -> "Vehicle":
    from slipbench.plant.errors import VehicleFileError
    from slipbench.plant.vehicle_file import load_vehicle
    from slipbench.protocol.errors import InputError

    try:
        return load_vehicle(vehicle)
    except VehicleFileError as fault:
        raise InputError(str(fault)) from fault

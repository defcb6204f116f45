"""The command `export-fmu`: a vehicle file, or an FMU with effects, as an FMU."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from slipbench.protocol.shipped_files import completion_of, file_of

if TYPE_CHECKING:  # the plant takes seconds to import; --help should not
    from slipbench.plant.fmu.bus import Bus
    from slipbench.plant.fmu.model import FmuModel
    from slipbench.plant.vehicle_file import Vehicle

VehiclePath = Annotated[
    Path,
    typer.Argument(
        help="Vehicle file (TOML), or the name of one that ships; or the improved file of an FMU.",
        metavar="FILE",
        parser=file_of("vehicle"),
        autocompletion=completion_of("vehicle"),
    ),
]
VERSION, GEAR, ENGINE_SPEED, STEP = 3, 2, "14000 rpm", "0.25 ms"


def register(app: typer.Typer) -> None:
    """Add `export-fmu` to the one command."""
    app.command("export-fmu")(export_fmu)


def export_fmu(
    vehicle: VehiclePath,
    out: Annotated[Path, typer.Option(help="New FMU.", metavar="FILE")],
    fmi: Annotated[
        int | None, typer.Option(help="Version of FMI, 2 or 3: 3 by default.", min=2, max=3)
    ] = None,
    gear: Annotated[
        int | None, typer.Option(help="Gear at the start, from 1: 2 by default.", min=1)
    ] = None,
    engine_speed: Annotated[
        str | None,
        typer.Option(help=f"Engine speed at the start, held by the throttle: {ENGINE_SPEED}."),
    ] = None,
    step: Annotated[
        str | None, typer.Option(help=f"Internal step of integration: {STEP} by default.")
    ] = None,
    bus: Annotated[
        Path | None,
        typer.Option(
            help="Role map or binding file: the FMU also sends and reads its CAN frames.",
            metavar="FILE",
            parser=file_of("role map", "binding"),
            autocompletion=completion_of("role map", "binding"),
        ),
    ] = None,
    dbc: Annotated[
        Path | None,
        typer.Option(
            help="Database, in place of the one that the role map names.",
            metavar="FILE",
            parser=file_of("database"),
            autocompletion=completion_of("database"),
        ),
    ] = None,
) -> None:
    """Export a simulation with its effects as an FMU for co-simulation.

    The improved file that `slipbench explain model.fmu` wrote, or the file beside an FMU, gives that
    FMU with calibrated parameters and effects around it, in the version of FMI that it has. The
    parameters of the effects are parameters of the new FMU. It is checked against the simulation of
    explain. It needs neither Python nor the old file.

    A vehicle file gives the virtual motorcycle. Inputs are throttle command, spark advance, gear,
    clutch, brakes, grip, grade and wind; outputs are speeds, slip, torques and every other quantity
    of the motorcycle; parameters are those of the vehicle file, all in SI. The FMU holds machine code
    for this platform and needs no Python. It is checked before it is written: by fmpy's validation,
    and by a sweep of throttle and spark, in which its outputs must equal those of the plant. Beside it
    a file of the same name with the suffix .toml says what is uncertain and recorded, so
    that `slipbench explain motorcycle.fmu RUN...` works.

    With --bus it is a node of a CAN network as well (FMI-LS-BUS 1.0, network abstraction; FMI 3.0). It
    reads the messages whose roles command the motorcycle, and sends those whose roles it shows, at the
    cycle times of the database, with counters and checksums.

    Exit status: 0 done, 2 invalid input (see message).

    Example: slipbench export-fmu nominal --out motorcycle.fmu
    """
    from slipbench.identification.mismatch.callables.fmu.fmu_file import is_of_an_fmu
    from slipbench.wrapper_command import export_wrapper

    if is_of_an_fmu(vehicle):
        _refuse_options(fmi=fmi, gear=gear, engine_speed=engine_speed, step=step, bus=bus, dbc=dbc)
        export_wrapper(vehicle, out)
    else:
        _export_motorcycle(
            vehicle,
            out,
            fmi or VERSION,
            gear or GEAR,
            engine_speed or ENGINE_SPEED,
            step or STEP,
            bus,
            dbc,
        )


def _refuse_options(**given: int | str | Path | None) -> None:
    """Raise InputError where options of a motorcycle are given for an FMU."""
    from slipbench.protocol.errors import InputError

    useless = [f"--{name.replace('_', '-')}" for name, value in given.items() if value is not None]
    if useless:
        raise InputError(
            f"{', '.join(useless)} has no effect on an FMU",
            expected="a vehicle file",
            remedy="leave the option out; an FMU keeps its version and its start values",
        )


def _export_motorcycle(
    vehicle: Path,
    out: Path,
    fmi: int,
    gear: int,
    engine_speed: str,
    step: str,
    roles: Path | None,
    dbc: Path | None,
) -> None:
    from slipbench.bench.vehicle.virtual_motorcycle import read_vehicle
    from slipbench.fmu_bus import read_bus, require_bus, words
    from slipbench.fmu_check import header_folder
    from slipbench.plant.fmu.explaining import file_beside
    from slipbench.plant.fmu.model import sensor_effects
    from slipbench.protocol.new_file import new_file, refuse_existing

    headers = header_folder()
    beside = out.with_suffix(".toml")
    for path in (out, beside):
        refuse_existing(path)
    known = read_vehicle(vehicle)
    model = _model(known, vehicle, gear, engine_speed, step)
    require_bus(fmi, roles, dbc)
    bound = None if roles is None else read_bus(roles, known.motorcycle, dbc)
    with new_file(out) as draft:
        apart = _write_checked(draft, model, fmi, headers, bound.bus if bound else None)
    with new_file(beside) as draft:
        draft.write_text(file_beside(model, known.plus_minus), encoding="utf-8")
    typer.echo(f"checked: valid; its outputs deviate from the plant by at most {apart:.1g}")
    typer.echo(
        f"starts: gear {gear}, {engine_speed}, throttle_command = {model.command:.6f};"
        f" internal step {step}"
    )
    if left_out := sensor_effects(known.motorcycle):
        typer.echo(f"not in it, since they act in a sensor: {', '.join(left_out)}")
    for line in () if bound is None else words(bound):
        typer.echo(line)
    typer.echo(f"written: {out} (FMI {fmi}.0), {beside}")
    typer.echo(f"compare it with recordings: slipbench explain {out} RUN...")


def _write_checked(
    path: Path, model: "FmuModel", fmi: int, headers: Path, bus: "Bus | None"
) -> float:
    """Write an FMU; return the largest deviation from the plant. Raises InputError."""
    from slipbench.fmu_check import largest_deviation, require_valid
    from slipbench.plant.errors import PlantError
    from slipbench.plant.fmu.export import write_fmu
    from slipbench.protocol.errors import InputError

    try:
        write_fmu(path, model, fmi, headers, bus)
    except PlantError as fault:
        raise InputError(str(fault)) from fault
    except ValueError as fault:
        raise InputError(str(fault), where="--bus", remedy="give another --step") from fault
    require_valid(path)
    return largest_deviation(path, model)


def _model(vehicle: "Vehicle", where: Path, gear: int, engine_speed: str, step: str) -> "FmuModel":
    """Return what is exported. Raises InputError where it cannot start."""
    from slipbench.plant.fmu.model import model_at
    from slipbench.plant.simulation import Simulation
    from slipbench.protocol.errors import InputError
    from slipbench.protocol.units import parse_quantity

    gears = len(vehicle.motorcycle.gears)
    if gear > gears:
        raise InputError(
            "no such gear", where=str(where), expected=f"1 to {gears}", found=str(gear)
        )
    seconds, speed = parse_quantity(step, "s"), parse_quantity(engine_speed, "rad/s")
    _check_step(seconds, step)
    try:
        simulation = Simulation(vehicle.motorcycle, seconds)
        return model_at(vehicle.name, simulation, gear, speed)
    except ValueError as fault:
        raise InputError(
            "the motorcycle cannot start there",
            where=str(where),
            found=str(fault),
            remedy="give another --gear or --engine-speed",
        ) from fault


def _check_step(seconds: float, written: str) -> None:
    """Raise InputError unless the step divides the period of commands and is small enough."""
    from slipbench.fmu_check import COMMUNICATION_STEP
    from slipbench.protocol.errors import InputError

    parts = COMMUNICATION_STEP / seconds if seconds > 0.0 else 0.0
    if not 2.0 <= parts <= 100.0 or abs(parts - round(parts)) > 1e-9 * parts:
        raise InputError(
            "this internal step cannot be used",
            where="--step",
            expected="1 ms divided by a whole number from 2 to 100",
            found=written,
        )

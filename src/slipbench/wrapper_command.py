"""`export-fmu` of an FMU: its calibrated parameters and effects as an FMU around it."""

from pathlib import Path

import typer

from slipbench.protocol.errors import InputError

CLOSE = 1e-6
"""Of an output's largest value: a deviation that is rounding."""


def export_wrapper(file: Path, out: Path) -> None:
    """Write the FMU that wraps another one, check it, and say what it has. Raises InputError."""
    from slipbench.fmu_check import header_folder, require_as_valid
    from slipbench.identification.mismatch.callables.fmu.fmu_system import open_fmu
    from slipbench.identification.mismatch.callables.fmu.wrapper.check import largest_deviation
    from slipbench.identification.mismatch.callables.fmu.wrapper.export import write_wrapper
    from slipbench.identification.mismatch.callables.fmu.wrapper.passed_on import require_passed_on
    from slipbench.identification.mismatch.callables.fmu.wrapper.sides import Sides
    from slipbench.plant.errors import PlantError
    from slipbench.protocol.new_file import new_file, refuse_existing

    headers = header_folder()
    refuse_existing(out)
    opened = open_fmu(file)
    require_passed_on(opened)
    sides = Sides(opened)
    with new_file(out) as draft:
        try:
            write_wrapper(draft, sides, headers)
        except PlantError as fault:
            raise InputError(str(fault)) from fault
        require_as_valid(draft, sides.opened.plan.fmu.path)
        apart = largest_deviation(draft, sides)
    typer.echo(
        f"checked: its outputs deviate from the simulation of explain by at most {apart:.1g}"
        " of their size"
    )
    if apart > CLOSE:
        typer.echo("take a smaller step of communication where that is too much")
    named = [e.key for e in sides.acting]
    typer.echo(f"effects: {', '.join(named) or 'none, calibrated parameters alone'}")
    if sides.left_out:
        typer.echo(f"not in it, since they act in a clock: {', '.join(sides.left_out)}")
    typer.echo(f"written: {out} (FMI {sides.opened.plan.fmu.version}, co-simulation)")

"""The one command: it joins the sub-commands of the packages."""

import sys

import typer

import bench.commands
import identification.commands
import identification.design.commands
import identification.fleet.commands
import identification.proof.commands
import identification.rehearsal.commands
import protocol.commands
from protocol.errors import InputError

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    help="Excite, record and identify the rear-wheel slip of a motorcycle over CAN.",
)
bench.commands.register(app)
identification.commands.register(app)
identification.design.commands.register(app)
identification.fleet.commands.register(app)
identification.proof.commands.register(app)
identification.rehearsal.commands.register(app)
protocol.commands.register(app)


def main() -> None:
    """Run the command; a user's mistake ends in one message and status 2."""
    try:
        app()
    except InputError as fault:
        sys.stderr.write(f"slipbench: {fault}\n")
        sys.exit(2)


if __name__ == "__main__":
    main()

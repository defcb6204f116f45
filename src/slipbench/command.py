"""The command `slipbench`: it joins the sub-commands of the packages."""

import sys

import typer

from slipbench.bench import commands as bench
from slipbench.identification import commands as identification
from slipbench.identification.closed_loop_simulation import commands as closed_loop_simulation
from slipbench.identification.design import commands as design
from slipbench.identification.fleet import commands as fleet
from slipbench.protocol import commands as protocol
from slipbench.protocol.errors import InputError
from slipbench.studies.blind_validation import commands as blind_validation
from slipbench.studies.paper import commands as paper

PARTS = (
    bench,
    identification,
    design,
    fleet,
    blind_validation,
    closed_loop_simulation,
    paper,
    protocol,
)

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    help="Excite, record and identify the rear-wheel slip of a motorcycle over CAN.",
)
for part in PARTS:
    part.register(app)


def main() -> None:
    """Run the command; invalid input ends in one message and status 2."""
    try:
        app()
    except InputError as fault:
        sys.stderr.write(f"slipbench: {fault}\n")
        sys.exit(2)
    except SystemError as fault:
        if not isinstance(fault.__cause__, KeyboardInterrupt):
            raise
        sys.stderr.write("Aborted!\n")  # Ctrl-C at a call into compiled code
        sys.exit(130)

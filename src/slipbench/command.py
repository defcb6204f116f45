"""The command `slipbench`: it joins the sub-commands of the packages."""

import errno
import os
import sys
from io import TextIOWrapper
from pathlib import Path

import typer

from slipbench import commands as installation
from slipbench import fmu_command as fmu
from slipbench import next_command as experiments
from slipbench import session_commands as track
from slipbench import view_command
from slipbench.bench import commands as bench
from slipbench.bench.loop.finalizer_interrupt import keep_interrupts
from slipbench.identification import commands as identification
from slipbench.identification.closed_loop_simulation import commands as closed_loop_simulation
from slipbench.identification.design import commands as design
from slipbench.identification.ecu import commands as ecu
from slipbench.identification.fleet import commands as fleet
from slipbench.identification.season import commands as season
from slipbench.protocol import commands as protocol
from slipbench.protocol.errors import InputError, is_interrupt, readable
from slipbench.studies.blind_validation import commands as blind_validation
from slipbench.studies.paper import commands as paper

PARTS = (
    bench,
    track,
    view_command,
    experiments,
    fmu,
    identification,
    design,
    ecu,
    fleet,
    season,
    blind_validation,
    closed_loop_simulation,
    paper,
    protocol,
    installation,
)

# What the operating system refuses whichever file it is: the machine is at a limit.
AT_A_LIMIT = {
    errno.EDQUOT,
    errno.EFBIG,
    errno.EIO,
    errno.EMFILE,
    errno.ENFILE,
    errno.ENOSPC,
    errno.EROFS,
}
# What it refuses for a file that a user names.
REFUSED = {
    errno.EACCES,
    errno.EEXIST,
    errno.EINVAL,
    errno.EISDIR,
    errno.ELOOP,
    errno.ENAMETOOLONG,
    errno.ENODEV,
    errno.ENOENT,
    errno.ENOTDIR,
    errno.ENOTEMPTY,
    errno.ENXIO,
    errno.EPERM,
}
PACKAGE = Path(__file__).parent

app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode="markdown")
for part in PARTS:
    part.register(app)


def main() -> None:
    """Run the command; invalid input ends in one message and status 2."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # a path may have bytes that are no text
            stream.reconfigure(errors="backslashreplace")
    keep_interrupts()
    try:
        app()
    except InputError as fault:
        sys.stderr.write(f"slipbench: {fault}\n")
        sys.exit(2)
    except OSError as fault:
        if not _is_for_the_user(fault):
            raise
        name = f"{readable(str(fault.filename), 200)}: " if fault.filename else ""
        sys.stderr.write(f"slipbench: {name}the operating system refuses: {fault.strerror}\n")
        sys.exit(2)
    except (KeyboardInterrupt, SystemError, RuntimeError) as fault:  # with Ctrl-C as the cause
        if not is_interrupt(fault):
            raise
        sys.stderr.write("Aborted!\n")
        sys.exit(130)


def _is_for_the_user(fault: OSError) -> bool:
    """Whether a user can act on this; a file of the package itself that is missing is a defect."""
    if fault.errno in AT_A_LIMIT:
        return True
    if fault.errno not in REFUSED or not isinstance(fault.filename, str | bytes):
        return False
    return not Path(os.fsdecode(fault.filename)).is_relative_to(PACKAGE)

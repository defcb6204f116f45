"""The command `slipbench`: it joins the sub-commands of the packages."""

import errno
import sys
from io import TextIOWrapper

import typer

from slipbench import commands as installation
from slipbench.bench import commands as bench
from slipbench.identification import commands as identification
from slipbench.identification.closed_loop_simulation import commands as closed_loop_simulation
from slipbench.identification.design import commands as design
from slipbench.identification.fleet import commands as fleet
from slipbench.protocol import commands as protocol
from slipbench.protocol.errors import InputError, readable
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
    installation,
)

# What the operating system may say of a file that a user names, or of a full machine.
REFUSED = {
    errno.EACCES,
    errno.EDQUOT,
    errno.EEXIST,
    errno.EFBIG,
    errno.EINVAL,
    errno.EIO,
    errno.EISDIR,
    errno.ELOOP,
    errno.EMFILE,
    errno.ENAMETOOLONG,
    errno.ENFILE,
    errno.ENODEV,
    errno.ENOENT,
    errno.ENOSPC,
    errno.ENOTDIR,
    errno.ENOTEMPTY,
    errno.ENXIO,
    errno.EPERM,
    errno.EROFS,
}

app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode="markdown")
for part in PARTS:
    part.register(app)


def main() -> None:
    """Run the command; invalid input ends in one message and status 2."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # a path may have bytes that are no text
            stream.reconfigure(errors="backslashreplace")
    try:
        app()
    except InputError as fault:
        sys.stderr.write(f"slipbench: {fault}\n")
        sys.exit(2)
    except OSError as fault:
        if fault.errno not in REFUSED:
            raise
        name = f"{readable(str(fault.filename), 200)}: " if fault.filename else ""
        sys.stderr.write(f"slipbench: {name}the operating system refuses: {fault.strerror}\n")
        sys.exit(2)
    except SystemError as fault:
        if not isinstance(fault.__cause__, KeyboardInterrupt):
            raise
        sys.stderr.write("Aborted!\n")  # Ctrl-C at a call into compiled code
        sys.exit(130)

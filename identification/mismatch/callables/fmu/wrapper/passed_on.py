"""Which variables of an FMU the FMU around it passes on: scalar real numbers."""

from slipbench.identification.mismatch.callables.fmu.fmu_system import OpenFmu
from slipbench.identification.mismatch.callables.fmu.kinds import PLAIN
from slipbench.identification.mismatch.callables.fmu.variables import Port
from slipbench.protocol.errors import InputError


def require_passed_on(opened: OpenFmu) -> None:
    """Raise InputError where the file beside an FMU names an element of an array or a whole number."""
    plan = opened.plan
    for port in (*plan.parameters, *plan.inputs, *plan.outputs):
        if port.kind.name not in PLAIN or len(port.starts) > 1:
            raise InputError(
                "the FMU around another one has scalar real variables only",
                where=f"{opened.beside}: {port.name}",
                expected=f"a scalar of type {' or '.join(PLAIN)}",
                found=_found(port),
                remedy="explain works with it; leave it out of the file for export-fmu",
            )


def _found(port: Port) -> str:
    size = len(port.starts)
    return f"an array of {size} numbers" if size > 1 else f"type {port.kind.name}"

"""Check that a wrapper can pass on all variables of an FMU: scalar real numbers only."""

from slipbench.identification.mismatch.callables.fmu.fmu_system import OpenFmu
from slipbench.identification.mismatch.callables.fmu.kinds import PLAIN
from slipbench.identification.mismatch.callables.fmu.variables import Port
from slipbench.protocol.errors import InputError


def require_passed_on(opened: OpenFmu) -> None:
    """Raise InputError where the TOML file of an FMU names an array element or an integer."""
    plan = opened.plan
    for port in (*plan.parameters, *plan.inputs, *plan.outputs):
        if port.kind.name not in PLAIN or len(port.starts) > 1:
            raise InputError(
                "the FMU around another one has scalar real variables only",
                where=f"{opened.beside}: {port.name}",
                expected=f"a scalar of type {' or '.join(PLAIN)}",
                found=_found_type(port),
                remedy="explain works with it; leave it out of the file for export-fmu",
            )


def _found_type(port: Port) -> str:
    size = len(port.starts)
    return f"an array of {size} numbers" if size > 1 else f"type {port.kind.name}"

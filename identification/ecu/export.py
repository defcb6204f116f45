"""Write a designed controller for an engine control unit: the script, a table, and what they lack.

out/slip_control.lua                 the law, for the Lua page of rusEFI
out/tractionControlEtbDrop.table     its static part, for TunerStudio, where it is asked for
out/README.md                        how to connect it, and what the control unit does not carry
"""

from dataclasses import dataclass
from pathlib import Path

from slipbench.identification.ecu.exported_law import ExportedLaw, exported_law
from slipbench.identification.ecu.lua_script import script
from slipbench.identification.ecu.notes import notes
from slipbench.identification.ecu.traction_table import SIGNS, traction_table, write_table
from slipbench.protocol.configuration import read_toml
from slipbench.protocol.controller_file import ControllerFile
from slipbench.protocol.errors import InputError

SCRIPT, NOTES = "slip_control.lua", "README.md"
RUSEFI, SPEEDUINO = "rusefi", "speeduino"


@dataclass(frozen=True)
class EcuRequest:
    """controller: file; unit: "rusefi"; target: slip; tick_rate: Hz; table: "added", "subtracted"
    or None for no table; out: new folder."""

    controller: Path
    unit: str
    target: float
    tick_rate: float
    table: str | None
    out: Path


def law_of(request: EcuRequest) -> ExportedLaw:
    """The law that is exported. Raises InputError where the control unit has no place for it."""
    _check_unit(request.unit)
    if request.table is not None and request.table not in SIGNS:
        raise InputError(
            "no such table", where="--table", expected=" or ".join(SIGNS), found=request.table
        )
    if request.out.exists():
        raise InputError(
            "this is there already",
            where=str(request.out),
            expected="a new folder",
            remedy="name another one with --out",
        )
    file = read_toml(request.controller, ControllerFile)
    return exported_law(file, request.target, request.tick_rate, str(request.controller))


def write_export(law: ExportedLaw, request: EcuRequest) -> list[Path]:
    """Write the files of an export. Raises InputError; then nothing is written."""
    text = script(law)
    table = traction_table(law) if request.table else None
    request.out.mkdir(parents=True)
    files = [request.out / SCRIPT]
    files[0].write_text(text, encoding="utf-8")
    if table is not None and request.table is not None:
        files.append(request.out / f"{table.name}.table")
        write_table(table, files[-1], request.table)
    files.append(request.out / NOTES)
    files[-1].write_text(notes(law, table, request.table), encoding="utf-8")
    return files


def _check_unit(unit: str) -> None:
    if unit == SPEEDUINO:
        raise InputError(
            "Speeduino has no traction control, so there is nothing to export to",
            where="--for speeduino",
            expected="a control unit that reads two wheel speeds and can reduce throttle or spark",
            found="launch control, flat shift and one vehicle speed; traction control is an open"
            " request (github.com/speeduino/speeduino/issues/1260)",
            remedy="--for rusefi, or slip control from the bench over CAN: slipbench trial",
        )
    if unit != RUSEFI:
        raise InputError(
            "this control unit is not known", where="--for", expected=RUSEFI, found=unit
        )

"""A recording made of one table that states names and units itself: no role map, no import.

Its roles are the names of its columns. A model file names them, as in `role = "motor speed"`.
"""

from pathlib import Path

import numpy as np

from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.from_arrays import own_roles
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import TableRules
from slipbench.protocol.recording.run_folder import read
from slipbench.protocol.tables import Table, is_table, read_table, samples
from slipbench.protocol.units import to_base
from slipbench.protocol.user_file import is_folder

RULES = TableRules()


def read_recording(path: Path) -> Recording:
    """Recording of a run folder, or of a file with a table.

    Raises InputError as `run_folder.read` does, and where a file holds frames or no samples.
    """
    if is_folder(path):
        return read(path)
    if not path.exists():
        raise InputError(
            "there is no recording of this name",
            where=str(path),
            expected="a run folder, or a file with a table",
            remedy="check the path",
        )
    if not is_table(path):
        raise InputError(
            "it is neither a run folder nor a table",
            where=str(path),
            remedy=f"for frames on a bus: slipbench roles {path.name} --dbc DATABASE,"
            " then slipbench import",
        )
    return _of_table(path, read_table(path))


def _of_table(path: Path, table: Table) -> Recording:
    """Take every column with numbers, a unit and times; report what the others lack."""
    found, missing, warnings = {}, {}, list(table.warnings)
    for name in table.names:
        try:
            scale = to_base(_unit(table, name))
            found[name] = samples(table, name, "", RULES), scale
        except (InputError, ValueError) as fault:
            missing[name] = str(fault).replace("\n  ", "; ")
    times = {one.clock for one, _ in found.values()}
    measured = {name: pair for name, pair in found.items() if name not in times}
    missing = {name: why for name, why in missing.items() if name not in times}
    if not any(one.time.size for one, _ in measured.values()):
        raise InputError(
            "no column can be used as it stands",
            where=str(path),
            expected='numbers under titles with units, as in "speed [rad/s]", beside a column of times',
            found="; ".join(f"{name}: {why}" for name, why in missing.items()),
            remedy=f"slipbench roles {path.name}, then slipbench import",
        )
    start = min(one.time[0] for one, _ in measured.values() if one.time.size)
    channels = {}
    for name, (one, (slope, offset, unit)) in measured.items():
        warnings += one.warnings
        value = slope * one.value + offset
        channels[name] = Channel(
            name, one.time - start, value, unit, "bus", f"column {name}", stated=table.units[name]
        )
    return Recording(
        folder=path,
        description={"warnings": list(dict.fromkeys(warnings))},
        trial=None,
        roles=own_roles(path.name, channels),
        channels=channels,
        missing=missing,
        duration=float(max(np.max(c.time, initial=0.0) for c in channels.values())),
    )


def _unit(table: Table, name: str) -> str:
    """Return the unit of a column. Raises ValueError where the table states none."""
    unit = table.units.get(name, "")
    if not unit:
        raise ValueError(
            f'no unit is stated: write it into the title, as in "{name} [1]" for a pure number'
        )
    return unit

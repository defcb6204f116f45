"""A recording made of arrays that are in memory: from a notebook, another tool, a simulation."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt

from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.channel import Channel, FloatArray
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source
from slipbench.protocol.units import to_base


def recording_of(
    name: str, time: npt.ArrayLike, values: Mapping[str, npt.ArrayLike], units: Mapping[str, str]
) -> Recording:
    """Make a recording of arrays on one clock.

    time: (n,) s, increasing. values: role -> (n,), in the unit of `units`; the recording holds SI.
    Raises InputError where an array or a unit cannot be used.
    """
    times = _array(time, "time", name)
    if times.size < 2 or not (np.diff(times) > 0.0).all():
        raise InputError("time is not increasing", where=name, expected="two samples or more, s")
    channels = {
        role: _channel(role, times, value, _unit(role, units, values, name), name)
        for role, value in values.items()
    }
    duration = float(times[-1] - times[0])
    return Recording(
        Path(name), {}, None, own_roles(name, channels), channels, {}, duration=duration
    )


def own_roles(title: str, channels: Mapping[str, Channel]) -> RoleMap:
    """Make the role map of channels that are roles themselves, each a column of its name."""
    return RoleMap(
        title=title,
        quantities={role: channel.unit for role, channel in channels.items()},
        roles={role: Source(column=role) for role in channels},
    )


def _unit(role: str, units: Mapping[str, str], values: Mapping[str, object], name: str) -> str:
    stray = [known for known in units if known not in values]
    if stray:
        raise InputError(
            f"a unit for {stray[0]!r}, which has no values",
            where=name,
            expected=f"one of {', '.join(values)}",
        )
    if role not in units:
        raise InputError(
            f"no unit for {role!r}", where=name, remedy='add it to units; "1" is without unit'
        )
    return units[role]


def _channel(role: str, time: FloatArray, value: npt.ArrayLike, unit: str, name: str) -> Channel:
    try:
        slope, offset, base = to_base(unit)
    except ValueError as fault:
        raise InputError(str(fault), where=f"{name}, {role!r}") from fault
    numbers = _array(value, role, name)
    if numbers.shape != time.shape:
        raise InputError(
            f"{role!r} and time have different lengths",
            where=name,
            expected=str(time.shape),
            found=str(numbers.shape),
        )
    return Channel(role, time, slope * numbers + offset, base, "bus", "arrays", stated=unit)


def _array(value: npt.ArrayLike, role: str, name: str) -> FloatArray:
    try:
        found = np.array(value, np.float64)
    except (TypeError, ValueError) as fault:
        raise InputError(
            f"{role!r} is no array of numbers", where=name, found=str(fault)
        ) from fault
    if found.ndim != 1:
        raise InputError(
            f"{role!r} is no array of one dimension", where=name, found=f"shape {found.shape}"
        )
    return found

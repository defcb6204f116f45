"""When each row of a table was measured, in seconds."""

import re
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.units import linear

FloatArray = npt.NDArray[np.float64]

_TIME_NAME = re.compile(
    r"(?:log(?:ger)?|gps|utc|unix|sample|elapsed|session)?[ _]*"
    r"(?:t(?![a-z])|time(?:[ _]?stamps?)?|date[ _]?time)"
    r"(?:[ _]*(?P<unit>s|sec|seconds?|ms|us|µs|ns|min))?(?: #\d+)?",
    re.IGNORECASE,
)
_UNITS = {"sec": "s", "secs": "s", "second": "s", "seconds": "s", "msec": "ms", "µs": "us"}

_CLOCK_TIME = re.compile(r"\s*(\d{1,2}):(\d{1,2})(?::(\d{1,2}(?:[.,]\d*)?))?\s*")

# An epoch that counts finer than seconds gives itself away by its size (s: 1973 to 5138).
_EPOCHS = ((1e17, "ns"), (1e14, "us"), (1e11, "ms"))


def is_time_name(name: str) -> bool:
    """Tell whether a column is called as time columns are."""
    return bool(_TIME_NAME.fullmatch(name.strip()))


def seconds(column: Any, name: str, unit: str, where: str) -> FloatArray:
    """Turn a time column into s, NaN where a cell is empty.

    Numbers are in `unit`; without one, in the unit of the name, or in ms, us or ns where they are
    as large as epochs in these units, else in s. Moments ("2024-05-01T12:00:00Z", "12:00:01.5") give s since 1970 or midnight.
    """
    pa = optional_library("pyarrow")

    try:
        return _seconds(column, name, unit, where)
    except (pa.ArrowInvalid, pa.ArrowNotImplementedError) as cause:
        raise InputError(
            f"the time column {name!r} cannot be read",
            where=where,
            expected="numbers, or times from 1678 to 2262",
            found=f"{column.type}: {str(cause)[:200]}",
            remedy="export the time in seconds, or name another time_column in the role map",
        ) from cause


def _seconds(column: Any, name: str, unit: str, where: str) -> FloatArray:
    import pyarrow as pa

    kind = column.type
    if pa.types.is_timestamp(kind):
        return _filled(column.cast(pa.timestamp("ns"))) * 1e-9
    if pa.types.is_time(kind):
        return _past_midnight(_filled(column.cast(pa.time64("ns"))) * 1e-9)
    if pa.types.is_string(kind):
        return _moments(column, name, where)
    number: FloatArray = np.asarray(
        column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False), np.float64
    )
    return number * _scale(unit or _unit_in(name) or _epoch_unit(number), name, where)


def _scale(unit: str, name: str, where: str) -> float:
    try:
        return linear(_UNITS.get(unit.casefold(), unit), "s")[0]
    except ValueError as cause:
        raise InputError(
            f"the time column {name!r} is in {unit!r}",
            where=where,
            expected="a unit of time: s, ms, us, ns, min",
            remedy='state it in the role map: [tables.NAME] time_unit = "ms"',
        ) from cause


def _unit_in(name: str) -> str:
    match = _TIME_NAME.fullmatch(name.strip())
    return (match["unit"] or "") if match else ""


def _epoch_unit(number: FloatArray) -> str:
    size = float(np.nanmax(np.abs(number), initial=0.0))
    return next((unit for least, unit in _EPOCHS if size > least), "s")


def _filled(column: Any) -> FloatArray:
    """Integers as floats with NaN for nothing; 64-bit epochs keep better than a microsecond."""
    valid = np.asarray(column.is_valid().to_numpy(zero_copy_only=False), np.bool_)
    number = np.asarray(column.cast("int64").fill_null(0).to_numpy(zero_copy_only=False), np.int64)
    return np.where(valid, number.astype(np.float64), np.nan)


def _past_midnight(time: FloatArray) -> FloatArray:
    """Times of day go on after midnight."""
    days = np.cumsum(np.concatenate([[0], np.nan_to_num(np.diff(time)) < -43_200]))
    return time + 86_400.0 * days


def _moments(column: Any, name: str, where: str) -> FloatArray:
    """Read dates and times of day that pyarrow took for text."""
    pa = optional_library("pyarrow")

    for kind in (pa.timestamp("ns", tz="UTC"), pa.timestamp("ns")):
        try:
            return _filled(column.cast(kind)) * 1e-9
        except pa.ArrowInvalid:
            continue
    texts = column.to_pylist()
    odd = next(
        (row for row, text in enumerate(texts) if not _CLOCK_TIME.fullmatch(text or "0:0")), -1
    )
    if odd >= 0:
        raise InputError(
            f"the time column {name!r} cannot be read",
            where=f"{where}: data row {odd + 1}",
            expected='numbers, "2024-05-01T12:00:00.5Z" or "12:00:00.5"',
            found=repr(texts[odd]),
            remedy="export the time in seconds",
        )
    return _past_midnight(np.array([_clock_time(text) for text in texts], np.float64))


def _clock_time(text: str | None) -> float:
    """Turn "12:00:01.5" into s since midnight."""
    match = _CLOCK_TIME.fullmatch(text or "")
    if match is None:
        return float("nan")
    hours, minutes, rest = match.groups(default="0")
    return 3600.0 * int(hours) + 60.0 * int(minutes) + float(rest.replace(",", "."))

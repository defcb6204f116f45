"""Times of the rows of a table, in s."""

import re
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.tables.dates import DateStyle, date_style, days
from slipbench.protocol.tables.table import Table
from slipbench.protocol.units import linear

FloatArray = npt.NDArray[np.float64]

_TIME_NAME = re.compile(
    r"(?:log(?:ger|ging)?|gps|gnss|utc|unix|epoch|sample|elapsed|session|relative|rel|system|device"
    r"|record(?:ing)?|run|abs(?:olute)?|messzeit)?[ _]*"
    r"(?:t(?![a-z])|time(?:[ _]?stamps?|[ _]of[ _]day)?|date[ _/]?time|i?tow|time[ _]of[ _]week|utc"
    r"|interval|zeit(?:stempel)?|temps|tempo|tiempo|tijd|tid|czas|uhrzeit|heure|hora)"
    r"(?:[ _]*(?:in[ _]+)?(?P<unit>s|sec|seconds?|ms|msec|us|µs|ns|min))?(?: #\d+)?",
    re.IGNORECASE,
)
_UNITS = {
    "unix time": "s",
    "unix": "s",
    "epoch": "s",
    "msec": "ms",
    "millis": "ms",
    "milliseconds": "ms",
    "µs": "us",
    "μs": "us",
}
# Names whose numbers have a unit of their own by a standard: u-blox's iTOW.
_STANDARD = {"itow": "ms"}

_CLOCK_TIME = re.compile(r"\s*(\d{1,2}):(\d{1,2})(?::(\d{1,2}(?:[.,]\d*)?))?\s*")

# An epoch in a unit finer than seconds is identified by its magnitude (s: 1973 to 5138).
_EPOCHS = ((1e17, "ns"), (1e14, "us"), (1e11, "ms"))


def is_time_name(name: str) -> bool:
    """Whether a column has a name that time columns have."""
    return bool(_TIME_NAME.fullmatch(name.strip()))


def seconds(column: Any, name: str, unit: str, table: Table) -> FloatArray:
    """Times in s of a time column, shape (n,), NaN where a cell is empty.

    Numbers are in `unit`; without one, in the unit of the name, or in ms, us or ns where they are
    as large as epochs in these units, else in s. Dates and times of day ("2024-05-01T12:00:00Z",
    "01.05.2024 12:00:00", "12:00:01.5") give s since 1970 or midnight. Raises InputError, with the
    row in `table`, where the column cannot be read as times.
    """
    pa = optional_library("pyarrow")

    try:
        return _seconds(column, name, unit, table)
    except (pa.ArrowInvalid, pa.ArrowNotImplementedError) as cause:
        raise InputError(
            f"the time column {name!r} cannot be read",
            where=table.where,
            expected="numbers, or times from 1678 to 2262",
            found=f"{column.type}: {str(cause)[:200]}",
            remedy="export the time in seconds, or name another time_column in the role map",
        ) from cause


def _seconds(column: Any, name: str, unit: str, table: Table) -> FloatArray:
    pa = optional_library("pyarrow")

    kind = column.type
    if pa.types.is_timestamp(kind):
        return _filled(column.cast(pa.timestamp("ns"))) * 1e-9
    if pa.types.is_time(kind):
        return past_midnight(_filled(column.cast(pa.time64("ns"))) * 1e-9)
    if pa.types.is_string(kind):
        return _moments(column, name, table)
    number: FloatArray = np.asarray(
        column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False), np.float64
    )
    return number * _scale(unit or _unit_in(name) or _epoch_unit(number), name, table.where)


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
    stated = (match["unit"] or "") if match else ""
    return stated or _STANDARD.get(name.strip().casefold(), "")


def _epoch_unit(number: FloatArray) -> str:
    size = float(np.nanmax(np.abs(number), initial=0.0))
    return next((unit for least, unit in _EPOCHS if size > least), "s")


def _filled(column: Any) -> FloatArray:
    """Integers as floats, NaN for an empty cell; a 64-bit epoch keeps better than a microsecond."""
    valid = np.asarray(column.is_valid().to_numpy(zero_copy_only=False), np.bool_)
    number = np.asarray(column.cast("int64").fill_null(0).to_numpy(zero_copy_only=False), np.int64)
    return np.where(valid, number.astype(np.float64), np.nan)


def past_midnight(time: FloatArray) -> FloatArray:
    """Times of day in s, continued after midnight."""
    days = np.cumsum(np.concatenate([[0], np.nan_to_num(np.diff(time)) < -43_200]))
    return time + 86_400.0 * days


def _moments(column: Any, name: str, table: Table) -> FloatArray:
    """Times in s of dates and times of day that pyarrow read as text."""
    pa = optional_library("pyarrow")

    for kind in (pa.timestamp("ns", tz="UTC"), pa.timestamp("ns")):
        try:
            return _filled(column.cast(kind)) * 1e-9
        except pa.ArrowInvalid:
            continue
    texts = [(text or "").strip() for text in column.to_pylist()]
    dated = [text.replace("T", " ").partition(" ") for text in texts]
    style = date_style([date for date, _, _ in dated])
    moments = [_moment(text, style) for text in texts]
    for row, (text, moment) in enumerate(zip(texts, moments, strict=True)):
        if moment is None and text:
            raise InputError(
                f"the time column {name!r} cannot be read",
                where=table.at_row(row),
                expected='numbers, "2024-05-01T12:00:00.5Z" or "12:00:00.5"',
                found=repr(text),
                remedy="export the time in seconds",
            )
    time = np.array([np.nan if moment is None else moment for moment in moments], np.float64)
    return time if any(" " in text for text in texts) else past_midnight(time)


def _moment(text: str, style: DateStyle) -> float | None:
    """Time in s of a text such as "12:00:01.5" or "01.05.2024 12:00:01.5"; None where it is none."""
    date, blank, clock = text.replace("T", " ").partition(" ")
    if not blank:
        return _clock_time(text)
    day, of_day = days(date, style), _clock_time(clock.removesuffix("Z"))
    return None if day is None or of_day is None else day * 86_400.0 + of_day


def _clock_time(text: str) -> float | None:
    """Time in s since midnight of a text such as "12:00:01.5"; None where it is none."""
    match = _CLOCK_TIME.fullmatch(text)
    if match is None:
        return None
    hours, minutes, remainder = match.groups(default="0")
    return 3600.0 * int(hours) + 60.0 * int(minutes) + float(remainder.replace(",", "."))


def dates(column: Any) -> tuple[npt.NDArray[np.float64], bool]:
    """Midnights in s since 1970 of a column of dates, shape (n,), NaN where a cell is none.

    The second value: whether day and month may be exchanged, because no number is above 12.
    """
    pa = optional_library("pyarrow")

    if pa.types.is_date(column.type):
        return _filled(column.cast(pa.timestamp("ns"))) * 1e-9, False
    texts = [text or "" for text in column.cast(pa.string()).to_pylist()]
    style = date_style(texts)
    found = [days(text.strip(), style) for text in texts]
    midnights = [np.nan if day is None else day * 86_400.0 for day in found]
    return np.array(midnights, np.float64), style.doubtful

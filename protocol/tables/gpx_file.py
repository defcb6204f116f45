"""Read GPX files: tracks of satellite receivers, phones and watches. Parsed by gpxpy.

Speed is taken from the file where it has one (GPX 1.0, Garmin's extension); else it is computed from
the positions, and the layout states it.
"""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.tables.groups import Group, table_of_groups
from slipbench.protocol.tables.table import Table
from slipbench.protocol.user_file import read_user_file

FloatArray = npt.NDArray[np.float64]

LARGEST = 1 << 28  # bytes
EARTH = 6_371_008.8  # m, mean radius
UNITS = {
    "latitude": "deg",
    "longitude": "deg",
    "altitude": "m",
    "speed": "m/s",
    "course": "deg",
    "atemp": "degC",
    "wtemp": "degC",
    "cad": "rpm",
}
COMPUTED = "speed from positions"


def read_gpx(path: Path) -> Table:
    """Table of all track points: positions in deg, altitude in m, speed in m/s, times in s since 1970.

    Points without a time are counted and omitted. Raises InputError where the file is damaged or has
    no track point with a time.
    """
    content = read_user_file(path, LARGEST)
    segments = [list(map(_values, segment)) for segment in _segments(content, str(path))]
    points = [point for segment in segments for point in segment]
    timed = [[point for point in segment if "time" in point] for segment in segments]
    kept = [point for segment in timed for point in segment]
    if not kept:
        raise InputError(
            "no track point with a time in this file",
            where=str(path),
            expected="track points with latitude, longitude and time",
            found=f"{len(points)} track points, none with a time",
            remedy="export the recorded track, not a planned route",
        )
    lost = len(points) - len(kept)
    warnings = [f"{path}: {lost} track points without a time are omitted"] if lost else []
    channels = {
        name: (np.array([point.get(name, np.nan) for point in kept]), UNITS.get(name, ""))
        for name in dict.fromkeys(name for point in kept for name in point if name != "time")
    }
    layout = [f"GPX, {len(kept)} track points in {sum(map(bool, timed))} segments, times in UTC"]
    if "speed" not in channels:
        channels[COMPUTED] = (np.concatenate([_speeds(segment) for segment in timed]), "m/s")
        layout.append("no speed in the file: computed from the positions (central differences)")
    group = Group(np.array([point["time"] for point in kept]), channels)
    return table_of_groups(str(path), [group], tuple(layout), tuple(warnings))


def _segments(content: bytes, where: str) -> Iterator[list[tuple[Any, Any]]]:
    """Track points of each segment, each with the same point as GPX 1.0 has it.

    GPX 1.1 has no speed and no course outside of extensions, but loggers write them there as well.
    """
    gpxpy = optional_library("gpxpy")

    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise _damaged(where, "a document type, which GPX does not have")
    try:
        text = content.decode(
            "utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
        )
        found = gpxpy.parse(text)
        old = gpxpy.parse(text, version="1.0")
    except Exception as cause:  # gpxpy and the XML library under it let many kinds through
        raise _damaged(where, f"{type(cause).__name__}: {cause}"[:200]) from cause
    for track, old_track in zip(found.tracks, old.tracks, strict=True):
        for segment, old_segment in zip(track.segments, old_track.segments, strict=True):
            yield list(zip(segment.points, old_segment.points, strict=True))


def _damaged(where: str, found: str) -> InputError:
    return InputError(
        "not a GPX file that can be read",
        where=where,
        expected="a whole GPX file, to </gpx>",
        found=found,
        remedy="was it written to its end? export it again",
    )


def _values(pair: tuple[Any, Any]) -> dict[str, float]:
    """Numbers of one track point by name; "time" in s since 1970."""
    point, old = pair
    named = {
        "latitude": point.latitude,
        "longitude": point.longitude,
        "altitude": point.elevation,
        "speed": old.speed if point.speed is None else point.speed,
        "course": old.course if point.course is None else point.course,
    }
    found = {name: float(value) for name, value in named.items() if value is not None}
    for extension in point.extensions:
        for element in extension.iter():
            name = str(element.tag).rpartition("}")[2]
            value = _number(element.text)
            if value is not None:
                found.setdefault(name, value)
    if isinstance(point.time, datetime):
        aware = point.time if point.time.tzinfo else point.time.replace(tzinfo=UTC)
        found["time"] = aware.timestamp()
    return found


def _number(text: str | None) -> float | None:
    try:
        return float(text or "")
    except ValueError:
        return None


def _speeds(points: list[dict[str, float]]) -> FloatArray:
    """Speed over ground at each point of a segment, (n,) m/s, by central differences."""
    time = np.array([point["time"] for point in points])
    latitude = np.radians([point["latitude"] for point in points])
    longitude = np.radians([point["longitude"] for point in points])
    if time.size < 2:
        return np.full(time.size, np.nan)
    steps = _distance(latitude, longitude)
    path = np.concatenate([[0.0], np.cumsum(steps)])
    before = np.maximum(np.arange(time.size) - 1, 0)
    after = np.minimum(np.arange(time.size) + 1, time.size - 1)
    span = time[after] - time[before]
    speed = np.divide(path[after] - path[before], span, np.full(time.size, np.nan), where=span > 0)
    return np.asarray(speed, np.float64)


def _distance(latitude: FloatArray, longitude: FloatArray) -> FloatArray:
    """Great-circle distance between neighbours, (n - 1,) m; haversine formula."""
    across = np.sin(np.diff(latitude) / 2) ** 2
    along = np.sin(np.diff(longitude) / 2) ** 2
    chord = across + np.cos(latitude[1:]) * np.cos(latitude[:-1]) * along
    return np.asarray(2 * EARTH * np.arcsin(np.sqrt(np.clip(chord, 0.0, 1.0))), np.float64)

"""Laws: GPX and FIT give the positions, speeds and times that were written; damage is said."""

from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.role_map import TableRules
from slipbench.protocol.tables import is_table, read_table, samples
from tests.protocol.tables.fit_writer import fit

gpxpy = pytest.importorskip("gpxpy", reason="pip install 'slipbench[logs]'")
pytest.importorskip("fitdecode", reason="pip install 'slipbench[logs]'")

ANY = TableRules()
START = 1_700_000_000.0
latitudes = st.floats(-89, 89).map(lambda value: round(value, 7))
longitudes = st.floats(-179.9, 179.9).map(lambda value: round(value, 7))
points = st.lists(st.tuples(latitudes, longitudes, st.floats(0, 60)), min_size=1, max_size=15)


def gpx_text(rows, speeds="extension", version="1.1"):
    """rows: time, latitude, longitude, speed."""
    body = []
    for time, latitude, longitude, speed in rows:
        moment = datetime.fromtimestamp(time, UTC).isoformat().replace("+00:00", "Z")
        held = {
            "extension": "<extensions><x:TrackPointExtension>"
            f"<x:speed>{speed!r}</x:speed><x:hr>120</x:hr></x:TrackPointExtension></extensions>",
            "element": f"<speed>{speed!r}</speed>",
            "none": "",
        }[speeds]
        body.append(
            f'<trkpt lat="{latitude!r}" lon="{longitude!r}"><ele>12.5</ele>'
            f"<time>{moment}</time>{held}</trkpt>"
        )
    space = f"http://www.topografix.com/GPX/{version.replace('.', '/')}"
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<gpx version="{version}" creator="x" xmlns="{space}"'
        ' xmlns:x="http://www.garmin.com/xmlschemas/TrackPointExtension/v2"><trk><trkseg>\n'
        + "\n".join(body)
        + "\n</trkseg></trk></gpx>\n"
    )


@given(points, st.sampled_from([("extension", "1.1"), ("element", "1.1"), ("element", "1.0")]))
@settings(max_examples=60, deadline=None)
def test_gpx_is_what_was_written(tmp_path_factory, rows, form):
    written = [(START + 0.5 * n, *row) for n, row in enumerate(rows)]
    path = tmp_path_factory.mktemp("gpx") / "x.gpx"
    path.write_text(gpx_text(written, *form))
    table = read_table(path)
    for position, name in ((1, "latitude"), (2, "longitude"), (3, "speed")):
        found = samples(table, name, "", ANY)
        assert found.value == pytest.approx([row[position] for row in written], abs=1e-12)
        assert found.time == pytest.approx([row[0] for row in written], abs=1e-5)
    assert [table.units[name] for name in ("latitude", "longitude", "speed", "altitude")] == [
        "deg",
        "deg",
        "m/s",
        "m",
    ]
    assert not table.warnings


@given(st.floats(-80, 80), st.floats(-179, 179), st.floats(0, 359), st.floats(1, 60))
@settings(max_examples=60, deadline=None)
def test_speed_from_positions_is_the_speed(tmp_path_factory, latitude, longitude, course, speed):
    """On a straight at constant speed, computed with another formula: a local plane."""
    radius = 6_371_008.8
    distance = speed * np.arange(12.0)
    north, east = distance * np.cos(np.radians(course)), distance * np.sin(np.radians(course))
    latitudes = latitude + np.degrees(north / radius)
    longitudes = longitude + np.degrees(east / (radius * np.cos(np.radians(latitudes))))
    rows = [
        (START + n, float(a), float(o), 0.0)
        for n, (a, o) in enumerate(zip(latitudes, longitudes, strict=True))
    ]
    path = tmp_path_factory.mktemp("gpx") / "x.gpx"
    path.write_text(gpx_text(rows, "none"))
    table = read_table(path)
    found = samples(table, "speed from positions", "", ANY)
    assert found.value == pytest.approx(speed, rel=2e-3)
    assert "computed from the positions" in table.layout[1]


def test_speed_is_not_computed_across_segments(tmp_path):
    rows = [(START + n, 50.0 + (5.0 if n > 3 else 0.0), 8.0, 0.0) for n in range(8)]
    text = gpx_text(rows, "none")
    lines = text.splitlines()
    lines.insert(6, "</trkseg><trkseg>")
    path = tmp_path / "x.gpx"
    path.write_text("\n".join(lines))
    assert samples(read_table(path), "speed from positions", "", ANY).value.max() == 0


def test_points_without_a_time_are_counted(tmp_path):
    rows = [(START + n, 50.0, 8.0, 1.0) for n in range(4)]
    text = gpx_text(rows)
    lines = text.splitlines()
    start, end = lines[3].index("<time>"), lines[3].index("</time>") + 7
    lines[3] = lines[3][:start] + lines[3][end:]
    path = tmp_path / "x.gpx"
    path.write_text("\n".join(lines))
    table = read_table(path)
    assert "1 track points without a time" in table.warnings[0]
    assert samples(table, "speed", "", ANY).value.size == 3


def test_a_document_type_is_refused(tmp_path):
    path = tmp_path / "x.gpx"
    bomb = '<!DOCTYPE gpx [<!ENTITY a "aaaaaaaaaa">]>'
    text = gpx_text([(START, 50.0, 8.0, 1.0)])
    path.write_text(text.replace('creator="x"', 'creator="&a;"').replace("<trk>", f"{bomb}<trk>"))
    with pytest.raises(InputError, match="document type"):
        read_table(path)


GPX = gpx_text([(START + n, 50.0 + n / 1000, 8.0, 1.5) for n in range(6)]).encode()
FIT = fit([(START + n, 50.0 + n / 1000, 8.0, 1.5, 20) for n in range(6)])


@given(st.integers(1, len(GPX) - 10))
@settings(max_examples=60, deadline=None)
def test_a_gpx_file_that_breaks_off_is_an_error(tmp_path_factory, length):
    path = tmp_path_factory.mktemp("gpx") / "x.gpx"
    path.write_bytes(GPX[:length])
    with pytest.raises(InputError):
        read_table(path)


@given(st.sampled_from([GPX, FIT]), st.data(), st.binary(min_size=1, max_size=3))
@settings(max_examples=200, deadline=None)
def test_damage_is_an_error_or_a_table(tmp_path_factory, content, data, damage):
    at = data.draw(st.integers(0, len(content)))
    path = tmp_path_factory.mktemp("damage") / "x.bin"
    path.write_bytes(content[:at] + damage + content[at + len(damage) :])
    try:
        table = read_table(path)
        for name in table.names:
            samples(table, name, "", ANY)
    except InputError:
        return


fit_rows = st.lists(
    st.tuples(
        st.floats(-90, 90),
        st.floats(-179, 179),
        st.one_of(st.none(), st.floats(0, 65)),
        st.integers(-40, 60),
    ),
    min_size=1,
    max_size=20,
)


@given(fit_rows)
@settings(max_examples=80, deadline=None)
def test_fit_is_what_was_written(tmp_path_factory, rows):
    """Positions to the resolution of the format; an invalid speed is no sample."""
    path = tmp_path_factory.mktemp("fit") / "x.fit"
    path.write_bytes(fit([(START + n, *row) for n, row in enumerate(rows)]))
    table = read_table(path)
    for position, name, unit in (
        (0, "latitude", "deg"),
        (1, "longitude", "deg"),
        (2, "speed", "m/s"),
        (3, "temperature", "degC"),
    ):
        known = [(START + n, row[position]) for n, row in enumerate(rows)]
        known = [(time, value) for time, value in known if value is not None]
        if not known:
            continue
        found = samples(table, name, "", ANY)
        step = 5.001e-4 if name == "speed" else 1e-7
        assert found.time.tolist() == [time for time, _ in known]
        assert found.value == pytest.approx([value for _, value in known], abs=step)
        assert found.unit == unit
    assert not table.warnings


@given(st.integers(20, len(FIT) - 1))
@settings(max_examples=80, deadline=None)
def test_a_fit_file_that_breaks_off_is_read_up_to_there_and_said(tmp_path_factory, length):
    path = tmp_path_factory.mktemp("fit") / "x.fit"
    path.write_bytes(FIT[:length])
    try:
        table = read_table(path)
    except InputError as cause:
        assert "no time series" in cause.what  # noqa: PT017  no record was complete
        assert length < len(FIT) - 70
        return
    assert "broken off" in table.warnings[0]
    read = samples(table, "latitude", "", ANY)
    assert read.value == pytest.approx([50.0 + n / 1000 for n in range(read.value.size)], abs=1e-7)


def test_a_changed_byte_is_found_by_the_checksum(tmp_path):
    path = tmp_path / "x.fit"
    content = bytearray(FIT)
    content[-30] ^= 1
    path.write_bytes(bytes(content))
    assert "FitCRCError" in read_table(path).warnings[0]


def test_both_are_known_by_their_content(tmp_path):
    for content in (GPX, FIT):
        path = tmp_path / "log.dat"
        path.write_bytes(content)
        assert is_table(path)

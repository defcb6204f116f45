"""Laws: a VBO file has the positions, times and units of whoever wrote it; damage is named."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.role_map import TableRules
from slipbench.protocol.tables import is_table, read_table, samples
from slipbench.protocol.tables.titles import unit_in_name

ANY = TableRules()
HEADER = """File created on 05/10/2023 @ 10:28:56

[header]
satellites
time
latitude
longitude
velocity kmh
heading
height
vertical velocity m/s
Brake Pressure
Lean

[channel units]
bar
deg

[comments]
(c) nobody
Log Rate (Hz) : 10.00

[column names]
sats time lat long velocity heading height vert-vel Brake_P Lean

[data]
"""


def clock(seconds):
    ticks = round(seconds * 100)
    hours, rest = divmod(ticks, 360_000)
    minutes, rest = divmod(rest, 6000)
    return f"{hours % 24:02d}{minutes:02d}{rest // 100:02d}.{rest % 100:02d}"


def row(time, latitude, longitude, speed, brake):
    return (
        f"012 {clock(time)} {latitude * 60:+013.7f} {-longitude * 60:+013.7f} {speed:07.3f}"
        f" 123.45 +00147.48 -0.12 {brake:+.6E} -1.5"
    )


def vbo(folder, rows, newline="\r\n", name="x.vbo"):
    path = folder / name
    path.write_bytes((HEADER + "\n".join(rows) + "\n").replace("\n", newline).encode())
    return path


points = st.lists(
    st.tuples(
        st.floats(-90, 90), st.floats(-180, 180), st.floats(0, 400), st.floats(0, 200)
    ),
    min_size=2,
    max_size=12,
)  # fmt: skip


@given(st.integers(0, 8_639_000), points, st.sampled_from(["\n", "\r\n"]))
@settings(max_examples=60, deadline=None)
def test_what_was_written_is_read(tmp_path_factory, start, rows, newline):
    """Positions, speeds and times of day in hundredths of a second, also over midnight."""
    times = [start / 100 + 0.1 * n for n in range(len(rows))]
    text = [row(t, *point) for t, point in zip(times, rows, strict=True)]
    table = read_table(vbo(tmp_path_factory.mktemp("vbo"), text, newline))
    for position, (name, unit) in enumerate(
        [("latitude", "deg"), ("longitude", "deg"), ("velocity", "km/h"), ("Brake_P", "bar")]
    ):
        found = samples(table, name, "", ANY)
        assert found.unit == unit
        assert found.value == pytest.approx([point[position] for point in rows], abs=6e-4, rel=1e-6)
        assert found.time == pytest.approx(times, abs=1e-5)
        assert not found.warnings
    assert samples(table, "vert-vel", "", ANY).unit == "m/s"
    assert samples(table, "Lean", "", ANY).unit == "deg"
    assert "VBO" in table.layout[0]


def test_east_is_positive(tmp_path):
    """In the file minutes to the west are positive."""
    line = "010 120000.00 +03124.500000 +00061.200000 0.0 0.0 100 0 0 0"
    table = read_table(vbo(tmp_path, [line, line.replace("00.00", "01.00")]))
    assert samples(table, "latitude", "", ANY).value[0] == pytest.approx(52.075)
    assert samples(table, "longitude", "", ANY).value[0] == pytest.approx(-1.02)


GOOD = [row(36_000 + 0.1 * n, 52, 9, 100, 3) for n in range(8)]
FOURTH = HEADER.count("\n") + 4  # line of the fourth row


@given(st.integers(0, 7), st.integers(1, 9))
@settings(max_examples=30, deadline=None)
def test_a_wrong_cell_is_named_by_line_and_column(tmp_path_factory, at, column):
    rows = [line.split() for line in GOOD]
    rows[at][column] = "4x"
    path = vbo(tmp_path_factory.mktemp("vbo"), [" ".join(cells) for cells in rows])
    with pytest.raises(InputError) as caught:
        samples(read_table(path), HEADER.splitlines()[-3].split()[column], "", ANY)
    line = HEADER.count("\n") + at + 1
    assert caught.value.where == f"{path}: line {line}, column {column + 1}"
    assert caught.value.found == "'4x'"


def test_a_time_that_is_none_is_named(tmp_path):
    rows = [*GOOD]
    rows[3] = rows[3].replace("100000.30", "106100.30")
    with pytest.raises(InputError, match=rf"line {FOURTH}, column 2.*\n.*hhmmss"):
        read_table(vbo(tmp_path, rows))


def test_a_position_outside_the_earth_is_said(tmp_path):
    rows = [*GOOD]
    rows[3] = row(36_000.3, 120, 9, 100, 3)
    table = read_table(vbo(tmp_path, rows))
    assert f"line {FOURTH}: 1 values are no latitude" in table.warnings[0]
    assert samples(table, "latitude", "", ANY).value.size == 7


@given(st.integers(0, len(HEADER) + 8 * len(GOOD[0])))
@settings(max_examples=100, deadline=None)
def test_a_file_that_breaks_off_is_an_error_or_is_said(tmp_path_factory, length):
    folder = tmp_path_factory.mktemp("vbo")
    content = vbo(folder, GOOD, "\n").read_bytes()
    path = folder / "torn.vbo"
    path.write_bytes(content[:length])
    try:
        table = read_table(path)
    except InputError:
        return
    whole = np.arange(table.data.num_rows)
    assert samples(table, "velocity", "", ANY).time == pytest.approx(36_000 + 0.1 * whole, abs=0.1)
    if content[length - 1 : length + 1].strip() and len(table.names) == 10:
        torn = content[:length].splitlines()[-1].split()
        assert table.warnings or len(torn) == 10


@given(st.integers(0, 900), st.binary(min_size=1, max_size=4))
@settings(max_examples=150, deadline=None)
def test_damage_is_an_error_or_a_table(tmp_path_factory, at, damage):
    folder = tmp_path_factory.mktemp("vbo")
    content = bytearray(vbo(folder, GOOD).read_bytes())
    content[at : at + len(damage)] = damage
    path = folder / "damaged.vbo"
    path.write_bytes(bytes(content))
    try:
        table = read_table(path)
        for name in table.names:
            samples(table, name, "", ANY)
    except InputError:
        return


def test_a_vbo_file_is_known_by_its_content(tmp_path):
    assert is_table(vbo(tmp_path, GOOD, name="log.dat"))
    assert unit_in_name("velocity kmh") == "km/h"


@pytest.mark.parametrize("stated", ["kmh", "knots", "mph"])
@pytest.mark.parametrize("columns", ["same", "other"])
def test_the_unit_of_the_speed_is_that_of_the_header(tmp_path, stated, columns):
    """Also where [header] has another number of lines than there are columns."""
    text = HEADER.replace("velocity kmh", f"velocity {stated}")
    if columns == "other":
        text = text.replace("satellites\n", "")
    path = tmp_path / "x.vbo"
    path.write_text(text + "\n".join(GOOD) + "\n")
    unit = {"kmh": "km/h", "knots": "knot", "mph": "mph"}[stated]
    assert samples(read_table(path), "velocity", "", ANY).unit == unit


OTHERS = ["Gear", "Brake_P", "Lean", "Torque"]  # columns of input modules


@given(
    st.lists(st.sampled_from(["", "bar", "deg", "Nm", "(null)", "km/h"]), min_size=4, max_size=4),
    st.booleans(),
    st.sampled_from(["File created on 07/12/2014 09:02:23", "A logger .vbo file\r\nof 2020", ""]),
)
def test_a_column_has_the_unit_of_its_line(tmp_path_factory, units, separated, banner):
    """An empty line in [channel units] is a column without a unit."""
    names = ["sats", "time", "lat", "long", "velocity", *OTHERS]
    titles = ["satellites", "time", "latitude", "longitude", "velocity kmh", *OTHERS]
    lines = [banner, "", "[header]", *titles, "", "[channel units]", *units, *[""] * separated]
    lines += ["[comments]", "", "[column names]", " ".join(names), "", "[data]"]
    lines += [f"9 12000{n}.00 +03119.09973 +00058.49277 36.0 1 2 3 4" for n in range(3)]
    path = tmp_path_factory.mktemp("vbo") / "x.vbo"
    path.write_text("\r\n".join(lines) + "\r\n", newline="")
    table = read_table(path)
    assert table.layout[0].startswith("VBO")
    found = [table.units.get(name, "") for name in OTHERS]
    expected = ["" if unit == "(null)" else unit for unit in units]
    assert found == expected


def test_units_that_fit_no_column_are_none(tmp_path):
    text = HEADER.replace("bar\ndeg\n", "bar\n\ndeg\nNm\n") + row(1, 50, 8, 90, 3) + "\n"
    (tmp_path / "x.vbo").write_text(text)
    table = read_table(tmp_path / "x.vbo")
    assert "Brake_P" not in table.units
    assert "Lean" not in table.units
    assert any("[channel units]" in text for text in table.warnings)

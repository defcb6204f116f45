"""Laws: a table is the same in any layout, encoding and style of units; a wrong cell names its place."""

from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.role_map import TableRules
from slipbench.protocol.tables import is_table, read_table, samples, write_parquet
from slipbench.protocol.tables.titles import split_unit, unit_in_name
from slipbench.protocol.units import linear

ANY = TableRules()
ENCODINGS = ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"]
UNITS = ["km/h", "m/s", "°C", "%", "bar", "deg/s", "rpm", "mm", "V", "kPa"]
STYLES = ["[{}]", " [{}]", "({})", " ({})", " {{{}}}", "row below", " in {}", ", {}"]
DIALECTS = [(",", "."), (";", ","), (";", "."), ("\t", "."), ("\t", ","), ("|", ".")]

number = st.floats(-1e6, 1e6, allow_nan=False).map(lambda value: round(value, 6))
rows_of = st.lists(st.tuples(number, number), min_size=3, max_size=20)


def table_of(folder, text, encoding="utf-8", name="x.csv"):
    path = folder / name
    path.write_bytes(text.encode(encoding))
    return read_table(path)


def cell(value, point):
    return f"{value:.6f}".replace(".", point)


@given(
    rows_of,
    st.tuples(st.sampled_from(UNITS), st.sampled_from(UNITS)),
    st.sampled_from(STYLES),
    st.sampled_from(DIALECTS),
    st.sampled_from(ENCODINGS),
    st.sampled_from(["Time", "Zeit", "Temps", "Tiempo", "timestamp", "Elapsed Time", "t"]),
)
@settings(max_examples=150, deadline=None)
def test_a_wide_table_is_the_same_in_every_style(
    tmp_path_factory, rows, units, style, dialect, encoding, clock
):
    """Names, units, times and values are those that were written."""
    delimiter, point = dialect
    titles = [f"{clock}", "Öldruck A", "Speed B"]
    if style == "row below":
        head = [delimiter.join(titles), delimiter.join(("s", *units))]
    else:
        quote = '"' if delimiter in style else ""
        marked = zip(titles, ("s", *units), strict=True)
        head = [delimiter.join(quote + n + style.format(u) + quote for n, u in marked)]
    body = [
        delimiter.join([cell(0.5 * n, point), cell(a, point), cell(b, point)])
        for n, (a, b) in enumerate(rows)
    ]
    folder = tmp_path_factory.mktemp("wide")
    table = table_of(folder, "\r\n".join([*head, *body]) + "\r\n", encoding)
    for position, name in enumerate(titles[1:]):
        found = samples(table, name, "", ANY)
        assert found.unit == units[position]
        assert found.time.tolist() == [0.5 * n for n in range(len(rows))]
        assert found.value.tolist() == [row[position] for row in rows]
    assert table.layout[0].startswith("CSV")
    assert not table.warnings


@given(
    st.dictionaries(
        st.sampled_from(["RPM", "Speed", "Gear", "Öl", "Temp 1"]),
        st.tuples(st.sampled_from(["", *UNITS]), rows_of),
        min_size=1,
    ),
    st.sampled_from(DIALECTS),
    st.sampled_from(ENCODINGS),
    st.sampled_from([("time", "signal", "value", "unit"), ("Zeit", "Kanal", "Wert", "Einheit")]),
    st.randoms(use_true_random=False),
)
@settings(max_examples=100, deadline=None)
def test_a_long_table_has_the_channels_that_were_written(
    tmp_path_factory, channels, dialect, encoding, titles, shuffle
):
    """Each channel has its own times, units and values, in whatever order the rows stand."""
    delimiter, point = dialect
    written = [
        (cell(0.25 * n, point), name, cell(row[0], point), unit)
        for name, (unit, rows) in channels.items()
        for n, row in enumerate(rows)
    ]
    shuffle.shuffle(written)
    text = "\n".join([delimiter.join(titles), *(delimiter.join(row) for row in written)])
    table = table_of(tmp_path_factory.mktemp("long"), text + "\n", encoding)
    for name, (unit, rows) in channels.items():
        found = samples(table, name, "", ANY)
        assert found.unit == unit
        assert found.time.tolist() == [0.25 * n for n in range(len(rows))]
        assert found.value.tolist() == [row[0] for row in rows]
    assert "long layout" in table.layout[1]


@given(
    st.integers(0, 30),
    st.integers(1, 3),
    st.lists(st.integers(0, 30), max_size=4),
    st.sampled_from(".,"),
)
@settings(max_examples=60, deadline=None)
def test_text_among_numbers_is_named_by_line_and_column(
    tmp_path_factory, row, column, blanks, mark
):
    """Whatever lines lie between: metadata, comments, empty lines. Also from the stored copy."""
    lines = ["Logger;XY", "", "time;a;b;c"]
    at = 0
    for n in range(31):
        if n in blanks:
            lines += ["", "# a remark"]
        cells = [str(n), *(f"{value}{mark}500" for value in (1, 2, 3))]
        if n == row:
            cells[column] = "12..5"
            at = len(lines) + 1
        lines.append(";".join(cells))
    folder = tmp_path_factory.mktemp("odd")
    table = table_of(folder, "\n".join(lines) + "\n")
    write_parquet(table, folder / "copy.parquet")
    for one in (table, read_table(folder / "copy.parquet")):
        with pytest.raises(InputError) as caught:
            samples(one, "abc"[column - 1], "", ANY)
        assert caught.value.where.endswith(f"x.csv: line {at}, column {column + 1}")
        assert caught.value.found == "'12..5'"


@given(st.integers(0, 20))
def test_text_among_the_numbers_of_a_long_table_names_the_line(tmp_path_factory, row):
    lines = ["time,channel,value"] + [f"{n},{'ab'[n % 2]},{n}.5" for n in range(21)]
    lines[row + 1] = f"{row},{'ab'[row % 2]},oops"
    with pytest.raises(InputError) as caught:
        table_of(tmp_path_factory.mktemp("odd"), "\n".join(lines) + "\n")
    assert f"line {row + 2}, column 'value'" in caught.value.where
    assert caught.value.found == "'oops'"


def test_one_channel_in_two_units_is_an_error(tmp_path):
    with pytest.raises(InputError, match=r"line 3, column 'unit'.*several units"):
        table_of(tmp_path, "time,signal,value,unit\n0,v,1,km/h\n1,v,2,m/s\n2,v,3,km/h\n")


SPELLED = [
    ("km/h", "m/s", 1 / 3.6, "km/h KMH kmh kph KPH Km/h km/hr kmph"),
    ("mph", "m/s", 0.44704, "mph MPH mi/h"),
    ("rpm", "rad/s", np.pi / 30, "rpm RPM Rpm 1/min U/min tr/min min-1 min^-1 rev/min"),
    ("deg", "rad", np.pi / 180, "deg Deg DEG ° Grad degrees"),
    ("deg/s", "rad/s", np.pi / 180, "deg/s °/s dps deg/sec"),
    ("bar", "Pa", 1e5, "bar Bar BAR"),
    ("g", "m/s^2", 9.80665, "g G"),
    ("degC", "K", 1.0, "C °C degC Celsius ºC"),
]


@pytest.mark.parametrize(
    ("unit", "to", "slope"),
    [(unit, to, slope) for _, to, slope, units in SPELLED for unit in units.split()],
)
def test_each_spelling_of_a_unit_is_that_unit(unit, to, slope):
    assert linear(unit, to)[0] == pytest.approx(slope, rel=1e-9)


@pytest.mark.parametrize(
    ("title", "name", "unit"),
    [
        ("Speed/km/h", "Speed/km/h", ""),
        ("Wheel speed, FL", "Wheel speed, FL", ""),
        ("Brake - F", "Brake - F", ""),
        ("v in km/h", "v", "km/h"),
        ("Yaw, deg/s", "Yaw", "deg/s"),
        ('EngineTemp|"F"|0|300|1', "EngineTemp", "F"),
        ("[bar]", "[bar]", ""),
    ],
)
def test_a_word_behind_a_name_is_a_unit_only_where_it_can_be_one(title, name, unit):
    assert split_unit(title) == (name, unit)


@pytest.mark.parametrize(
    ("name", "unit"),
    [("speed_kmh", "km/h"), ("engineSpeedRpm", "rpm"), ("rpm", "rpm"), ("AccX_g", "standard_gravity"),
     ("speed_m_per_s", "m/s"), ("log", ""), ("mode_g", ""), ("deg", ""), ("handlebar", "")],
)  # fmt: skip
def test_the_end_of_a_name_states_a_unit(name, unit):
    assert unit_in_name(name) == unit


def test_a_guessed_unit_is_shown(tmp_path):
    table = table_of(tmp_path, "time_ms,speed_kmh,state\n0,36,1\n10,72,1\n")
    assert samples(table, "speed_kmh", "", ANY).unit == "km/h"
    assert samples(table, "speed_kmh", "", ANY).time.tolist() == [0, 0.01]
    assert table.layout[1] == "units taken from names: speed_kmh [km/h]"


AIM = """"Format","AiM CSV File"
"Session","Practice"
"Vehicle","R6"
"Sample Rate","20","Hz"
"Beacon Markers","61.2","120.9"

"Time","GPS Speed","RPM","Brake Press"
"s","km/h","rpm","bar"

"0.000","36.0","5000","1.5"
"0.050","37.0","5100","1.6"
"0.100","38.0","5200","1.7"
"""
RACE_CAPTURE = """"Interval"|"ms"|0|0|1,"Utc"|"ms"|0|0|1,"RPM"|""|0|10000|50,"Speed"|"mph"|0.0|150.0|10
100,1700000000000,1000,10.5
120,1700000000020,1001,
140,1700000000040,1002,10.75
"""


def test_race_studio(tmp_path):
    table = table_of(tmp_path, AIM)
    assert samples(table, "Brake Press", "", ANY).unit == "bar"
    assert samples(table, "GPS Speed", "", ANY).value.tolist() == [36, 37, 38]
    assert "of AiM" in table.layout[0]


def test_race_capture(tmp_path):
    table = table_of(tmp_path, RACE_CAPTURE)
    found = samples(table, "Speed", "", ANY)
    assert (found.unit, found.value.tolist()) == ("mph", [10.5, 10.75])
    assert found.time == pytest.approx([0.1, 0.14])


def test_german_tempo_is_a_speed_where_its_unit_says_so(tmp_path):
    table = table_of(tmp_path, "Tempo [km/h];Zeit [s]\n36,5;0,0\n37,5;0,1\n")
    assert samples(table, "Tempo", "", ANY).time.tolist() == [0, 0.1]


NOON = datetime(2024, 5, 13, 12, 0, 0, tzinfo=UTC).timestamp()


@pytest.mark.parametrize(
    ("date", "clock"),
    [
        ("2024-05-13", "12:00:0{}"),
        ("13.05.2024", "12:00:0{}.0"),
        ("13/05/2024", "12:00:0{}"),
        ("05/13/2024", "12:00:0{}.00"),
        ("13.05.24", "12:00:0{},0"),
    ],
)
@pytest.mark.parametrize("columns", ["two", "one"])
def test_dates_in_a_column_of_their_own_or_before_the_time(tmp_path, date, clock, columns):
    between = ";" if columns == "two" else " "
    head = "Date;Time;v" if columns == "two" else "Time;v"
    rows = [f"{date}{between}{clock.format(n)};{n}" for n in range(3)]
    found = samples(table_of(tmp_path, "\n".join([head, *rows]) + "\n"), "v", "", ANY)
    assert found.time.tolist() == [NOON, NOON + 1, NOON + 2]
    assert not found.warnings


def test_a_doubtful_date_is_said(tmp_path):
    table = table_of(tmp_path, "Date,Time,v\n03/04/2024,12:00:00,1\n03/04/2024,12:00:01,2\n")
    found = samples(table, "v", "", ANY)
    assert np.diff(found.time).tolist() == [1]
    assert "day and month may be exchanged" in found.warnings[0]


def test_a_comma_that_may_divide_thousands_is_said(tmp_path):
    table = table_of(tmp_path, "time;rpm\n0;1,000\n1;2,000\n")
    assert "decimal commas" in table.warnings[0]


def test_latin_1_is_read(tmp_path):
    table = table_of(tmp_path, "Zeit;Öldruck [bar]\n0,0;1,5\n0,1;1,6\n", "latin-1")
    assert samples(table, "Öldruck", "", ANY).value.tolist() == [1.5, 1.6]
    assert "Windows-1252" in table.layout[0]


def test_a_table_is_known_by_its_content(tmp_path):
    path = tmp_path / "log.001"
    path.write_text(AIM)
    assert is_table(path)
    path.write_text("nothing that anybody reads\n" * 5)
    assert not is_table(path)


@given(st.integers(0, 400), st.binary(min_size=1, max_size=3))
@settings(max_examples=150, deadline=None)
def test_damage_is_an_error_or_is_said(tmp_path_factory, at, damage):
    """Any bytes in place of others: an error of ours, or a table; never a traceback."""
    content = bytearray(AIM.encode())
    content[at : at + len(damage)] = damage
    path = tmp_path_factory.mktemp("damage") / "x.csv"
    path.write_bytes(bytes(content))
    try:
        table = read_table(path)
        for name in table.names:
            samples(table, name, "", ANY)
    except InputError:
        return


RACE_CHRONO = """This file is created using RaceChrono Pro
Format,3
Session title,"Lap day"

timestamp,lap_number,elapsed_time,speed,latitude,rpm
unix time,,s,m/s,deg,rpm
,,,100: gps,100: gps,200: obd
1700000000.000,1,0.000,10.5,52.1,3000
1700000000.100,1,0.100,10.6,52.1,3010
1700000000.200,1,0.200,,52.1,3020
"""
HP_TUNERS = """HP Tuners CSV Log File - Export
Version: 1.0

[Log Information]
Creation Time: 1/2/2024 10:00:00

[Channel Information]
0,12,13,2310
Offset,Engine RPM,Vehicle Speed,Coolant Temp
s,rpm,km/h,deg C

[Channel Data]
0.000,850,36.0,85
0.050,860,37.0,85
0.100,870,38.0,86
"""
TORQUE = """Device Time, Longitude, Latitude,GPS Speed (Meters/second), G(x), G(y),Engine RPM(rpm)
13-May-2024 12:00:00.000,8.1,52.1,10.5,0.1,9.7,-
13-May-2024 12:00:01.000,8.1,52.1,10.6,0.2,9.8,1500
"""
TRACK_ADDICT = """# RaceRender Data: TrackAddict 4.6
# User Settings: SmoothAccel=0
"Time","UTC Time","Lap","Speed (Km/h)","Engine Speed (rpm) *OBD","Throttle Position (%) *OBD"
0.000,1700000000.000,0,36.0,1500,10
0.050,1700000000.050,0,37.0,1510,11
# Lap 1: 00:01:02.3
0.100,1700000000.100,1,38.0,1520,12
"""
LOGGERS = [
    (RACE_CHRONO, "speed", "m/s", [10.5, 10.6], 1_700_000_000.0),
    (RACE_CHRONO, "rpm", "rpm", [3000, 3010, 3020], 1_700_000_000.0),
    (HP_TUNERS, "Vehicle Speed", "km/h", [36, 37, 38], 0.0),
    (HP_TUNERS, "Coolant Temp", "deg C", [85, 85, 86], 0.0),
    (TORQUE, "GPS Speed", "Meters/second", [10.5, 10.6], NOON),
    (TORQUE, "G(y)", "", [9.7, 9.8], NOON),
    (TORQUE, "Engine RPM", "rpm", [1500], NOON + 1),
    (TRACK_ADDICT, "Engine Speed *OBD", "rpm", [1500, 1510, 1520], 0.0),
    (TRACK_ADDICT, "Speed", "Km/h", [36, 37, 38], 0.0),
]


@pytest.mark.parametrize(("text", "name", "unit", "values", "start"), LOGGERS)
def test_exports_of_known_loggers(tmp_path, text, name, unit, values, start):
    table = table_of(tmp_path, text)
    found = samples(table, name, "", ANY)
    assert found.value.tolist() == values
    assert found.unit == unit
    assert found.time[0] == pytest.approx(start, abs=1e-6)
    assert not table.warnings


@given(st.lists(st.integers(1, 12), min_size=2, max_size=4), st.sampled_from(["Time [s]", "t"]))
@settings(max_examples=30, deadline=None)
def test_several_time_columns_are_each_for_those_behind_them(tmp_path_factory, lengths, title):
    """Signals of different rates side by side; the shorter ones end in empty cells."""
    titles = [each for n in range(len(lengths)) for each in (title, f"signal {n}", f"other {n}")]
    rows = [
        [
            f"{value}" if row < length else ""
            for n, length in enumerate(lengths)
            for value in (round(row * 0.01 * (n + 1), 4), row + n, -row)
        ]
        for row in range(max(*lengths, 3))
    ]
    rows = [row for row in rows if any(row)]
    text = "\n".join([",".join(titles), *map(",".join, rows)]) + "\n"
    table = table_of(tmp_path_factory.mktemp("clocks"), text)
    for n, length in enumerate(lengths):
        found = samples(table, f"other {n}", "", ANY)
        assert found.value.tolist() == [-row for row in range(length)]
        assert found.time == pytest.approx([row * 0.01 * (n + 1) for row in range(length)])
    assert "time columns, each for the columns behind it" in table.layout[-1]

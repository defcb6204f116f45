"""Laws: a table means the same however it was exported; what is not a number is never guessed."""

from datetime import UTC, datetime

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyarrow import parquet

from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.role_map import TableRules
from slipbench.protocol.tables import read_table, samples, write_parquet

ANY = TableRules()


def table_of(tmp_path, text, name="x.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return read_table(path)


MOTEC = """"Format","MoTeC CSV File",,,"Workbook",""
"Venue","Somewhere",,,"Worksheet",""
"Driver","A, B",,,"Engine ID",""
"Log Date","04/05/2021",,,"Session","1"
"Sample Rate","50.000","Hz","","Start Time","0.000","s"
"Duration","0.100","s",,"End Time","0.100","s"
"Beacon Markers","52.1 104.9"


"Time","Engine RPM","Ground Speed"
"s","rpm","km/h"


"0.000","1000","36"
"0.020","1001","37"
"0.040","1002","38"
"""

SAME = {
    "comma": "Time (s),Engine RPM (rpm),Ground Speed (km/h)\n0,1000,36\n0.02,1001,37\n"
    "0.04,1002,38\n",
    "bracket": "Time[s], Engine RPM[rpm], Ground Speed[km/h]\n0, 1000, 36\n0.02, 1001, 37\n"
    "0.04, 1002, 38\n",
    "decimal comma": "Time [s];Engine RPM [rpm];Ground Speed [km/h]\n0,0;1000;36,0\n"
    "0,02;1001;37,0\n0,04;1002;38,0\n",
    "tabs": "Time\tEngine RPM\tGround Speed\ns\trpm\tkm/h\n0\t1000\t36\n0.02\t1001\t37\n"
    "0.04\t1002\t38\n",
    "spaces": "# made by hand\n#  Time [s]\n\nTime  Engine_RPM Ground_Speed\n s   rpm  km/h\n"
    "0.0  1000   36\n0.02 1001   37\n0.04 1002   38\n",
    "milliseconds": "Time (ms),Engine RPM (rpm),Ground Speed (km/h)\n0,1000,36\n20,1001,37\n"
    "40,1002,38\n",
    "trailing comma": "Time (s),Engine RPM (rpm),Ground Speed (km/h),\n0,1000,36,\n0.02,1001,37,\n"
    "0.04,1002,38,\n",
    "names in a comment": "#A logger\n#Time (s),Engine RPM (rpm),Ground Speed (km/h)\n0,1000,36\n"
    "0.02,1001,37\n# a remark\n0.04,1002,38\n",
    "windows": "Time (s),Engine RPM (rpm),Ground Speed (km/h)\r\n0,1000,36\r\n0.02,1001,37\r\n"
    "0.04,1002,38\r\n",
    "quoted": '"Time (s)","Engine RPM (rpm)","Ground Speed (km/h)"\n"0","1000","36"\n'
    '"0.02","1001","37"\n"0.04","1002","38"\n',
    "clock times": "Time;Engine RPM [rpm];Ground Speed [km/h]\n00:00:00.00;1000;36\n"
    "00:00:00.02;1001;37\n00:00:00.04;1002;38\n",
    "motec": MOTEC,
}


@pytest.mark.parametrize("form", SAME)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_one_table_in_many_dresses(tmp_path, form, encoding):
    table = table_of(tmp_path, SAME[form], encoding=encoding)
    joint = "_" if form == "spaces" else " "
    for name, unit, value in (
        (f"Engine{joint}RPM", "rpm", [1000, 1001, 1002]),
        (f"Ground{joint}Speed", "km/h", [36, 37, 38]),
    ):
        found = samples(table, name, "", ANY)
        assert found.time.tolist() == pytest.approx([0, 0.02, 0.04])
        assert found.value.tolist() == value
        assert found.unit == unit
        assert not found.warnings
    assert not table.warnings


@given(
    st.lists(
        st.tuples(st.floats(0, 1e6), st.one_of(st.none(), st.floats(-1e6, 1e6)), st.booleans()),
        min_size=2,
        max_size=40,
    ),
    st.sampled_from([(",", "."), (";", ","), (";", "."), ("\t", "."), ("|", ".")]),
)
@settings(max_examples=60, deadline=None)
def test_numbers_survive_any_dialect(tmp_path_factory, rows, dialect):
    """Empty cells are no samples; rows out of order are sorted and told."""
    delimiter, point = dialect
    path = tmp_path_factory.mktemp("table") / "x.csv"

    def cell(value):
        return "" if value is None else repr(value).replace(".", point)

    lines = [delimiter.join(("time", "value", "flag"))]
    lines += [delimiter.join((cell(t), cell(v), str(f).lower())) for t, v, f in rows]
    path.write_text("\n".join(lines) + "\n")
    found = samples(read_table(path), "value", "", ANY)
    kept = sorted(((t, v) for t, v, _ in rows if v is not None), key=lambda row: row[0])
    assert found.time.tolist() == [t for t, _ in kept]
    assert found.value.tolist() == [v for _, v in kept]
    times = [t for t, v, _ in rows if v is not None]
    assert bool(found.warnings) == (times != sorted(times))


EPOCH = datetime(2024, 5, 1, 12, 0, 0, tzinfo=UTC).timestamp()


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("2024-05-01T12:00:00Z", "2024-05-01T12:00:00.5Z"),
        ("2024-05-01T14:00:00+02:00", "2024-05-01T14:00:00.500+02:00"),
        ("2024-05-01 12:00:00", "2024-05-01 12:00:00.500"),
        (f"{EPOCH:.0f}", f"{EPOCH + 0.5:.1f}"),
        (f"{EPOCH * 1e3:.0f}", f"{EPOCH * 1e3 + 500:.0f}"),
        (f"{EPOCH * 1e6:.0f}", f"{EPOCH * 1e6 + 5e5:.0f}"),
        (f"{int(EPOCH) * 10**9}", f"{int(EPOCH) * 10**9 + 500_000_000}"),
    ],
)
def test_moments_are_seconds_since_1970(tmp_path, first, second):
    table = table_of(tmp_path, f"timestamp,speed\n{first},1\n{second},2\n")
    assert samples(table, "speed", "", ANY).time == pytest.approx([EPOCH, EPOCH + 0.5], abs=1e-6)


def test_times_of_day_go_on_after_midnight(tmp_path):
    table = table_of(tmp_path, "time,speed\n23:59:59.5,1\n00:00:00.5,2\n")
    assert np.diff(samples(table, "speed", "", ANY).time) == pytest.approx([1.0])


def test_each_channel_may_have_its_own_time_column(tmp_path):
    table = table_of(tmp_path, "t_a,a,t_b,b\n0,1,0.5,10\n1,2,1.5,20\n2,3,,\n")
    assert samples(table, "a", "t_a", ANY).time.tolist() == [0, 1, 2]
    found = samples(table, "b", "t_b", ANY)
    assert (found.time.tolist(), found.value.tolist()) == ([0.5, 1.5], [10, 20])


def test_without_a_time_column_a_sample_period_is_asked_for(tmp_path):
    table = table_of(tmp_path, "u,y\n1,2\n3,4\n5,6\n")
    with pytest.raises(InputError, match="sample_period"):
        samples(table, "y", "", ANY)
    found = samples(table, "y", "", TableRules(sample_period="2 ms"))
    assert found.time == pytest.approx([0, 0.002, 0.004])


def test_text_among_numbers_names_the_row(tmp_path):
    table = table_of(tmp_path, "time,speed\n0,1\n1,2\n2,oops\n3,4\n")
    with pytest.raises(InputError, match=r"line 4, column 2: .*\n.*\n.*'oops'"):
        samples(table, "speed", "", ANY)


@pytest.mark.parametrize("hole", ["", "-", "NaN", "nan", "N/A", "null"])
def test_holes_are_no_samples(tmp_path, hole):
    table = table_of(tmp_path, f"time,speed\n0,1\n1,{hole}\n2,3\n")
    assert samples(table, "speed", "", ANY).time.tolist() == [0, 2]


def test_a_wrong_column_names_the_nearest(tmp_path):
    table = table_of(tmp_path, "time,ground speed\n0,1\n1,2\n")
    with pytest.raises(InputError, match="did you mean 'ground speed'"):
        samples(table, "grund speed", "", ANY)


def test_a_torn_last_row_is_left_out_and_told(tmp_path):
    table = table_of(tmp_path, "time,a,b\n0,1,2\n1,2,3\n2,3")
    assert samples(table, "b", "", ANY).time.tolist() == [0, 1]
    assert "the last row is incomplete" in table.warnings[0]


def test_an_odd_row_names_its_line(tmp_path):
    with pytest.raises(InputError, match="line 3"):
        table_of(tmp_path, "time,a,b\n0,1,2\n1,2\n2,3,4\n3,4,5\n")


@pytest.mark.parametrize("text", ["", "\n\n", "just some words\nand more\n", "a,b,c\n"])
def test_what_is_no_table_is_refused(tmp_path, text):
    with pytest.raises(InputError, match=r"x\.csv"):
        table_of(tmp_path, text)


@given(st.binary(max_size=300))
@settings(max_examples=100, deadline=None)
def test_any_bytes_are_read_or_refused(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("table") / "x.csv"
    path.write_bytes(b"time,a\n0,1\n" + content)
    try:
        table = read_table(path)
        for name in table.names:
            samples(table, name, "", ANY)
    except InputError:
        return


@pytest.mark.parametrize("form", SAME)
def test_the_stored_copy_is_the_table(tmp_path, form):
    table = table_of(tmp_path, SAME[form])
    write_parquet(table, tmp_path / "copy.parquet")
    copy = read_table(tmp_path / "copy.parquet")
    assert copy.names == table.names
    assert dict(copy.units) == dict(table.units)
    assert copy.data.equals(table.data)
    assert copy.decimal == table.decimal
    assert copy.where == "x.csv"  # messages name the file that the user knows


def test_parquet_of_others(tmp_path):
    path = tmp_path / "x.parquet"
    moments = pa.array([0, 500_000_000], pa.timestamp("ns", tz="UTC"))
    parquet.write_table(pa.table({"timestamp": moments, "Speed (km/h)": [36.0, 72.0]}), path)
    found = samples(read_table(path), "Speed", "", ANY)
    assert found.time.tolist() == [0, 0.5]
    assert found.unit == "km/h"
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(InputError, match="Parquet"):
        read_table(path)


@pytest.mark.parametrize("unit", ["LA", "", "kPa/s", "%"])
def test_an_unknown_unit_in_a_row_of_units_stays_a_unit(tmp_path, unit):
    """MoTeC's LA, for lambda, is in no library of units; the names are in the row above."""
    text = MOTEC.replace('"Ground Speed"', '"Lambda"').replace('"km/h"', f'"{unit}"')
    for form in (text, "Time,Engine RPM,Lambda\ns,rpm," + unit + "\n0,1000,36\n0.02,1001,37\n"):
        table = table_of(tmp_path, form)
        assert table.names[:3] == ["Time", "Engine RPM", "Lambda"]
        assert table.units.get("Lambda", "") == unit
        assert table.units["Engine RPM"] == "rpm"


def test_a_row_of_names_below_a_title_is_no_row_of_units(tmp_path):
    table = table_of(tmp_path, "a,b,c\nt,Throttle position,s\n0,1,2\n1,2,3\n")
    assert table.names == ["t", "Throttle position", "s"]


def test_a_cell_of_more_than_128_kib_is_an_error(tmp_path):
    """Python's csv module raises an exception of its own for it."""
    for text in ("a,b\n1," + "x" * 140_000 + "\n1,2\n", "a," + "x" * 140_000 + "\n1,2\n1,2\n"):
        with pytest.raises(InputError, match="not a table"):
            table_of(tmp_path, text)


HARD = ["1_000", "0x1F", "١", "1e", "infinity", "1,5,5", "true-ish", "", "nan", "12:00", "-"]


@pytest.mark.parametrize("cell", HARD)
@pytest.mark.parametrize("column", ["t", "v"])
def test_a_column_without_numbers_is_no_samples_or_an_error(tmp_path, cell, column):
    cells = {"t": "0", "v": "1"} | {column: f'"{cell}"'}
    text = "t,v,n\n" + f"{cells['t']},{cells['v']},7\n" * 5
    for whole in (text, text + "0,1,8\n"):
        try:
            found = samples(table_of(tmp_path, whole), "v", "", ANY)
        except InputError:
            continue
        assert np.isfinite(found.value).all()


KINDS = [
    pa.array([True, False]),
    pa.array([b"x", b"y"]),
    pa.array(["0", "x"], pa.large_string()),
    pa.array(["0", "x"]).dictionary_encode(),
    pa.array([0, 1], pa.date32()),
    pa.array([-(2**52), 2**52], pa.timestamp("s")),
    pa.array([0, 1], pa.duration("s")),
    pa.array([None, None], pa.null()),
    pa.array([[1], [2]]),
    pa.array([{"a": 1}, {"a": 2}]),
]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: str(kind.type))
@pytest.mark.parametrize("column", ["t", "v"])
def test_a_column_of_any_type_is_read_or_an_error(tmp_path, kind, column):
    columns = {"t": pa.array([0.0, 1.0]), "v": pa.array([1.0, 2.0])} | {column: kind}
    parquet.write_table(pa.table(columns), tmp_path / "x.parquet")
    try:
        found = samples(read_table(tmp_path / "x.parquet"), "v", "t", ANY)
    except InputError:
        return
    assert np.isfinite(found.time).all()


@pytest.mark.parametrize("limit", ["MOST_CELLS", "MOST_BYTES"])
def test_a_table_larger_than_a_limit_is_refused_before_it_is_unpacked(tmp_path, monkeypatch, limit):
    path = tmp_path / "x.parquet"
    parquet.write_table(pa.table({"t": np.arange(1000.0), "v": ["x" * 500] * 1000}), path)
    read_table(path)
    assert path.stat().st_size < 30_000
    monkeypatch.setattr(f"slipbench.protocol.tables.parquet_file.{limit}", 1999 * 100)
    if limit == "MOST_CELLS":
        monkeypatch.setattr("slipbench.protocol.tables.parquet_file.MOST_CELLS", 1999)
    with pytest.raises(InputError, match="too large to be read"):
        read_table(path)


def test_columns_of_one_name_are_numbered(tmp_path):
    columns = [pa.array([0.0, 1.0]), pa.array([1, 2]), pa.array([3, 4])]
    table = pa.Table.from_arrays(columns, names=["t", "v", "v"])
    parquet.write_table(table, tmp_path / "x.parquet")
    read = read_table(tmp_path / "x.parquet")
    assert read.names == ["t", "v", "v #2"]
    assert samples(read, "v #2", "", ANY).value.tolist() == [3, 4]

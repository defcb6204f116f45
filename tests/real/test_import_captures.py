"""The captures of real vehicles, through the role maps that are kept here."""

import os
from pathlib import Path

import numpy as np
import pytest

from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.decode import sort_log
from slipbench.protocol.logs.formats import FORMATS, looks_like
from slipbench.protocol.recording import run_folder
from slipbench.protocol.recording.import_log import Capture, import_capture
from slipbench.protocol.recording.role_map import TableRules
from slipbench.protocol.tables import read_table, samples
from tests.paths import ROOT

FOLDER = Path(os.environ.get("SLIPBENCH_RECORDINGS", ROOT.parent / "shared" / "recordings"))
ENABLE = f"put the recordings into {FOLDER} or name their folder in SLIPBENCH_RECORDINGS"

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"no real recordings; {ENABLE}")

CAPTURES = {
    "subaru_wrx": (
        "subaru_wrx/can_sample.log",
        "subaru_wrx/sample_can_spec.dbc",
        {"accessport": "subaru_wrx/accessport_sample.csv"},
    ),
    "yamaha_r1": (
        "yamaha_r1/session.log",
        "yamaha_r1/session.dbc",
        {"gps": "yamaha_r1/gps.csv", "lean": "yamaha_r1/lean.csv"},
    ),
    "gt86": ("gt86_gt350/gt86_vsslog.log", "subaru_wrx/sample_can_spec.dbc", {}),
    "gt350": ("gt86_gt350/gt350_vsslog.trc", "gt86_gt350/ford_lincoln_base_pt.dbc", {}),
    "comma2k19": (
        "comma2k19/segment.log",
        "comma2k19/segment.dbc",
        {"pose": "comma2k19/pose_speed.csv"},
    ),
}

# Frames, seconds and identifiers; by `wc -l`, and for the trace by its last message number.
SIZES = {
    "subaru_wrx": (82_558, 90.3, 35),
    "yamaha_r1": (42_236, 418.6, 11),
    "gt86": (19_878, 20.3, 36),
    "gt350": (50_638, 33.2, 72),
    "comma2k19": (98_800, 60.0, 125),
}


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Every capture imported once, with all its side tables."""
    out = tmp_path_factory.mktemp("runs")
    return {
        name: import_capture(
            Capture(
                FOLDER / log,
                ROOT / f"examples/roles/{name}.toml",
                FOLDER / database,
                {table: FOLDER / file for table, file in tables.items()},
            ),
            out / name,
        )
        for name, (log, database, tables) in CAPTURES.items()
    }


@pytest.mark.parametrize("name", CAPTURES)
def test_every_frame_is_there(recordings, name):
    frames, seconds, identifiers = SIZES[name]
    recording = recordings[name]
    assert recording.frame_count == frames
    assert recording.duration == pytest.approx(seconds, abs=0.15)
    log = read_log(recording.folder / "frames.log").frames
    assert np.unique(log.identifier).size == identifiers
    if FORMATS[looks_like((FOLDER / CAPTURES[name][0]).read_bytes()[:200])].reader == "candump":
        kept = (recording.folder / "frames.log").read_bytes()
        assert kept == (FOLDER / CAPTURES[name][0]).read_bytes()


@pytest.mark.parametrize("name", CAPTURES)
def test_every_role_of_the_map_is_bound(recordings, name):
    assert not recordings[name].missing
    assert not recordings[name].description["warnings"]


@pytest.mark.parametrize("name", CAPTURES)
def test_reading_back_is_the_import(recordings, name):
    again = run_folder.read(recordings[name].folder)
    assert again.frame_count == recordings[name].frame_count
    assert again.faults == recordings[name].faults
    for role, channel in recordings[name].channels.items():
        assert np.array_equal(channel.time, again.channels[role].time)
        assert np.array_equal(channel.value, again.channels[role].value)


@pytest.mark.parametrize("name", CAPTURES)
def test_channels_are_the_decoded_log(recordings, name):
    """One role of each capture against the plain decode of the original file."""
    log, database, _ = CAPTURES[name]
    frames = read_log(FOLDER / log).frames
    decoded = sort_log(frames, load_database(FOLDER / database)).frames
    recording = recordings[name]
    role = "rear_left_wheel_speed"
    if role not in recording.channels:
        role = "rear_wheel_speed"
    message, signal = recording.roles.roles[role].signals[0].split(".")
    direct = decoded[message].samples(signal)
    channel = recording.channels[role]
    assert channel.value.size == direct.rows.size
    since = (frames.time_ns[direct.rows] - frames.time_ns[0]) * 1e-9
    assert np.allclose(channel.time, since, atol=1e-9)
    moving = direct.value != 0
    ratio = channel.value[moving] / direct.value[moving]
    assert np.ptp(ratio) < 1e-12  # one unit, converted once


RATES = [
    ("subaru_wrx", "rear_left_wheel_speed", 50),
    ("subaru_wrx", "engine_speed", 100),
    ("subaru_wrx", "throttle_position", 100),
    ("subaru_wrx", "brake", 50),
    ("yamaha_r1", "rear_wheel_speed", 10),
    ("yamaha_r1", "gnss_speed", 10),
    ("yamaha_r1", "lean_angle", 10),
    ("gt86", "rear_right_wheel_speed", 50),
    ("gt350", "rear_tooth_counter", 50),
    ("gt350", "rear_wheel_speed", 100),
    ("comma2k19", "front_left_wheel_speed", 83),
    ("comma2k19", "gnss_speed", 20),
]


@pytest.mark.parametrize(("name", "role", "rate"), RATES)
def test_rates_are_those_of_the_loggers(recordings, name, role, rate):
    time = recordings[name].channels[role].time
    assert (time.size - 1) / (time[-1] - time[0]) == pytest.approx(rate, rel=0.02)


def at(recording, role, times):
    channel = recording.channels[role]
    return np.interp(times, channel.time, channel.value)


def test_gt86_stands_on_its_front_wheels(recordings):
    channels = recordings["gt86"].channels
    assert not channels["front_wheel_speed"].value.any()
    assert channels["rear_wheel_speed"].value.max() == pytest.approx(30.2, abs=0.1)


def test_gt350_counts_its_rear_teeth(recordings):
    """The wheel by its counter turns as far as by its angular speed."""
    recording = recordings["gt350"]
    counter = recording.channels["rear_tooth_counter"].value
    assert (counter.min(), counter.max()) == (0, 255)
    turns = np.sum(np.diff(counter) % 256) / recording.roles.vehicle.teeth_per_turn
    speed = recording.channels["rear_left_wheel_speed"]
    angle = np.sum(speed.value[:-1] * np.diff(speed.time)) / 0.337
    assert turns == pytest.approx(angle / (2 * np.pi), rel=0.005)
    top = recording.channels["vehicle_speed"].value.max()
    assert speed.value.max() == pytest.approx(top, rel=0.005)


def test_the_yamaha_leans_into_its_turns(recordings):
    recording = recordings["yamaha_r1"]
    times = np.arange(20.0, 400.0, 0.1)
    course = recording.channels["course"]
    turning = np.gradient(np.interp(times, course.time, np.unwrap(course.value)), times)
    speed = at(recording, "gnss_speed", times)
    lean = np.tan(at(recording, "lean_angle", times))
    assert np.corrcoef(lean[speed > 10], (turning * speed)[speed > 10])[0, 1] > 0.9
    lean = np.degrees(recording.channels["lean_angle"].value)
    assert (lean.min(), lean.max()) == pytest.approx((-53.7, 56.8), abs=0.1)
    assert recording.channels["engine_speed"].value.max() * 30 / np.pi == pytest.approx(
        14_368, abs=1
    )


@pytest.mark.parametrize(
    ("name", "wheel", "reference", "bias"),
    [
        ("yamaha_r1", "front_wheel_speed", "gnss_speed", 0.05),
        ("comma2k19", "front_wheel_speed", "gnss_speed", 0.015),
        ("subaru_wrx", "rear_wheel_speed", "vehicle_speed", 0.01),
    ],
)
def test_wheels_agree_with_a_speed_from_elsewhere(recordings, name, wheel, reference, bias):
    recording = recordings[name]
    times = np.arange(5.0, recording.duration - 5.0, 0.1)
    true, seen = at(recording, reference, times), at(recording, wheel, times)
    fast = true > 8.0
    assert np.median(seen[fast] / true[fast]) == pytest.approx(1.0, abs=bias)


def test_the_second_logger_of_the_subaru_agrees(recordings, tmp_path):
    """Its offset, stated in the role map, lays its engine speed onto the bus's."""
    recording = recordings["subaru_wrx"]
    table = read_table(FOLDER / "subaru_wrx/accessport_sample.csv")
    found = samples(table, "RPM", "", TableRules())
    times = np.arange(1.0, 89.0, 0.05)
    rules = recording.roles.tables["accessport"]
    other = np.interp(times, found.time + rules.time_offset, found.value)
    ours = at(recording, "engine_speed", times) * 30 / np.pi
    assert np.sqrt(np.mean((ours - other) ** 2)) < 20  # rpm


def test_the_toyota_needs_no_bus_but_names_one(recordings):
    origins = {c.origin.split()[0] for c in recordings["comma2k19"].channels.values()}
    assert origins == {"can0", "table"}


READABLE = {
    "formats/candump.log": 12_974,
    "formats/obd2_logger.mf4": 5_588,
    "gt86_gt350/vab_allgears.log": 18_396,
}


@pytest.mark.parametrize("file", READABLE)
def test_other_logs_read(file):
    reading = read_log(FOLDER / file)
    assert len(reading.frames) == READABLE[file]
    assert not reading.warnings


@pytest.mark.parametrize(
    ("file", "told"),
    [
        ("BusMasterLog.log", "BUSMASTER"),
        ("CRTD_Log.txt", "CRTD"),
        ("CarBusAnalyzer.trc", "CAR BUS Analyzer"),
        ("ASAP2_Demo_V171.mf4", "43 decoded channels"),
    ],
)
def test_what_cannot_be_read_says_what_it_is(file, told):
    with pytest.raises(InputError) as fault:
        read_log(FOLDER / "formats" / file)
    assert told in str(fault.value)
    assert "remedy" in str(fault.value)


def test_an_mdf_file_of_channels_is_a_table():
    table = read_table(FOLDER / "formats/ASAP2_Demo_V171.mf4")
    found = samples(table, "ASAM.M.SCALAR.UBYTE.FORM_X_PLUS_4", "", TableRules())
    assert (found.value.size, found.unit) == (1240, "rpm")
    assert np.median(np.diff(found.time)) == pytest.approx(0.01, rel=1e-3)
    slow = samples(table, "ASAM.M.SCALAR.SBYTE.IDENTICAL.DISCRETE", "", TableRules())
    assert slow.value.size == 124  # each group keeps its own time


TABLES = {
    "subaru_wrx/accessport_sample.csv": ("RPM", 18_033, ""),
    "yamaha_r1/gps.csv": ("speed_m_per_s", 4_196, ""),
    "yamaha_r1/lean.csv": ("lean_deg", 4_183, ""),
    "comma2k19/pose_speed.csv": ("speed_m_per_s", 1_200, ""),
    "flexible_link/swept1-0-10hz.txt": ("v", 2_000, ""),
    "crank_teeth/nick_1.csv": ("Channel 3", 5_196, ""),
    "crank_teeth/trigger_adc_real1.csv": ("crank", 60_000, ""),
    "coupled_drives/DATAPRBS.csv": ("z1", 500, "20 ms"),
    "coupled_drives/DATAUNIF.csv": ("z11", 500, "20 ms"),
    "silverbox_tanks/SNLS80mV.csv": ("V2", 131_072, "1.6384 ms"),
    "silverbox_tanks/tanque.csv": ("yEst", 1_024, "4 s"),
    "silverbox_tanks/robot-arm.csv": ("y", 1_024, "1 s"),
}


@pytest.mark.parametrize("file", TABLES)
def test_tables_read(file):
    column, rows, period = TABLES[file]
    table = read_table(FOLDER / file)
    if period:
        with pytest.raises(InputError, match="sample_period"):
            samples(table, column, "", TableRules())
    rules = TableRules(sample_period=period) if period else TableRules()
    found = samples(table, column, "", rules)
    assert found.value.size == rows
    assert not found.warnings
    assert not table.warnings

"""Laws: an imported recording keeps every frame, and reading it is decoding the log itself."""

import shutil

import numpy as np
import pytest

from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.candump_line import format_line
from slipbench.protocol.logs.decode import sort_log
from slipbench.protocol.recording import run_folder
from slipbench.protocol.recording.import_log import Capture, import_capture
from slipbench.protocol.recording.sender_check import alternates

DBC = """VERSION ""
NS_ :
BS_:
BU_: CAR
BO_ 256 Wheels: 4 CAR
 SG_ Front : 0|16@1+ (0.01,0) [0|655.35] "km/h" CAR
 SG_ Rear : 16|16@1+ (0.01,0) [0|655.35] "km/h" CAR
BO_ 512 Engine: 3 CAR
 SG_ Speed : 0|16@1+ (1,0) [0|65535] "rpm" CAR
 SG_ Gear : 16|8@1+ (1,0) [0|255] "" CAR
"""

ROLES = """title = "A car"
[roles.front_wheel_speed]
signals = ["Wheels.Front"]
[roles.rear_wheel_speed]
signals = ["Wheels.Rear"]
[roles.engine_speed]
signals = ["Engine.Speed"]
[roles.gear]
signals = ["Engine.Gear"]
unknown = [255.0]
"""

GPS_ROLE = """
[roles.gnss_speed]
table = "gps"
column = "speed"
unit = "km/h"
"""

START = 1_700_000_000_000_000_000


def wheels(front, rear):
    return int(front * 100).to_bytes(2, "little") + int(rear * 100).to_bytes(2, "little")


def drive(count=200, start=START, bus="can0"):
    """Lines of a drive at 100 Hz, with a message that the database does not know."""
    lines = []
    for n in range(count):
        time = start + n * 10_000_000
        lines += [
            format_line(time, bus, 0x100, wheels(50 + n * 0.01, 52 + n * 0.01)),
            format_line(time + 1_000_000, bus, 0x200, bytes([n % 256, 8, 255 if n < 5 else 3])),
            format_line(time + 2_000_000, bus, 0x333, bytes([n % 256])),
        ]
    return lines


@pytest.fixture
def folder(tmp_path):
    """A folder with a log, a database and a role map."""
    (tmp_path / "drive.log").write_bytes(b"".join(drive()))
    (tmp_path / "car.dbc").write_text(DBC)
    (tmp_path / "roles.toml").write_text(ROLES)
    return tmp_path


def bring(folder, log="drive.log", roles="roles.toml", out="run", database="car.dbc", **tables):
    capture = Capture(
        folder / log,
        folder / roles,
        folder / database if database else None,
        {name: folder / file for name, file in tables.items()},
    )
    return import_capture(capture, folder / out)


def test_every_line_of_the_log_is_kept(folder):
    recording = bring(folder)
    assert (folder / "run/frames.log").read_bytes() == (folder / "drive.log").read_bytes()
    assert recording.frame_count == 600
    assert next(f for f in recording.faults if f.message == "0x333").count == 200


def test_reading_is_decoding_the_log(folder):
    bring(folder)
    channels = run_folder.read(folder / "run").channels
    log = read_log(folder / "drive.log").frames
    found = sort_log(log, load_database(folder / "car.dbc")).frames
    rear = found["Wheels"].samples("Rear")
    assert np.allclose(channels["rear_wheel_speed"].value, rear.value / 3.6, rtol=1e-12)
    assert np.allclose(
        channels["rear_wheel_speed"].time, (log.time_ns[rear.rows] - log.time_ns[0]) * 1e-9
    )
    assert channels["engine_speed"].value[0] == pytest.approx(8 * 256 * np.pi / 30)
    assert channels["gear"].value.tolist() == [3.0] * 195  # 255 says "not known"


def test_the_description_tells_what_was_done(folder):
    recording = bring(folder)
    run = run_folder.read(folder / "run").description["run"]
    assert run["kind"] == "import"
    assert run["frames"] == 600
    assert run["start_time_ns"] == START == recording.start_time_ns
    assert run["started"].startswith("2023-11-14T22:13:20")
    source = recording.description["sources"][0]
    assert source["file"] == "drive.log"
    assert source["sha256"] == run_folder.sha256(folder / "drive.log")
    assert str(folder) not in (folder / "run/run.toml").read_text()


def test_an_existing_folder_is_never_touched(folder):
    (folder / "run").mkdir()
    (folder / "run/precious").write_text("x")
    with pytest.raises(InputError, match="--out"):
        bring(folder)
    assert [item.name for item in (folder / "run").iterdir()] == ["precious"]


@pytest.mark.parametrize(
    ("file", "content", "told"),
    [
        ("drive.log", b"", "empty"),
        ("drive.log", drive(3)[0] + b"rubbish\n" + drive(3)[1], "line 2"),
        ("car.dbc", b"not a database", "DBC"),
        ("roles.toml", ROLES.encode().replace(b"Wheels.Front", b"Weels.Front"), "Wheels"),
        ("roles.toml", ROLES.encode().replace(b"Wheels.Front", b"Wheels.Frnt"), "Wheels.Front"),
        ("roles.toml", ROLES.encode().replace(b"front_wheel_speed", b"front_weel_speed"), "front_"),
        ("roles.toml", ROLES.encode() + b'unti = "rpm"\n', "unit"),
        ("roles.toml", ROLES.encode() + b'unit = "kg"\n', "unit"),
    ],
)
def test_a_mistake_names_its_place_and_leaves_nothing(folder, file, content, told):
    (folder / file).write_bytes(content)
    with pytest.raises(InputError) as fault:
        bring(folder)
    assert told in str(fault.value)
    assert not (folder / "run").exists()


def test_a_message_on_two_buses_asks_for_the_bus(folder):
    (folder / "drive.log").write_bytes(b"".join(sorted(drive() + drive(bus="can1"))))
    with pytest.raises(InputError) as fault:
        bring(folder)
    assert "can0, can1" in str(fault.value)
    assert 'bus = "can0"' in str(fault.value)
    text = ROLES.replace('"]\n', '"]\nbus = "can1"\n')
    (folder / "roles.toml").write_text(text)
    assert bring(folder).channels["rear_wheel_speed"].origin.startswith("can1 ")


def test_two_vehicles_on_one_bus_are_told_not_averaged(folder):
    other = [
        format_line(START + n * 10_000_000 + 5_000_000, "can0", 0x100, wheels(90 - n * 0.01, 95))
        for n in range(200)
    ]
    (folder / "drive.log").write_bytes(b"".join(sorted(drive() + other)))
    recording = bring(folder)
    assert "two senders" in recording.missing["front_wheel_speed"]
    assert "front_wheel_speed" not in recording.channels
    assert any(f.fault == "two senders" and f.message == "Wheels" for f in recording.faults)
    assert recording.frame_count == 800


def test_a_chattering_signal_is_not_two_senders():
    """Two courses differ by more than they change; a noisy or a ringing one does not."""
    draw = np.random.default_rng(3)
    slow = np.sin(np.arange(500) / 50)
    assert not alternates(slow)
    assert not alternates(draw.normal(size=500))
    assert not alternates(slow + 0.1 * draw.normal(size=500))
    assert not alternates(np.tile([0.0, 1.0], 250))  # a switch
    assert alternates(np.where(np.arange(500) % 2, slow, slow[::-1] + 5.0))


def test_what_is_missing_is_named_with_the_reason(folder):
    lines = [line for line in drive() if b" 100#" not in line]
    short = [format_line(START + n, "can0", 0x100, b"\1\2\3") for n in range(7)]
    (folder / "drive.log").write_bytes(b"".join(short + lines))
    (folder / "roles.toml").write_text(ROLES + GPS_ROLE)
    recording = bring(folder)
    assert "7 frames of Wheels" in recording.missing["rear_wheel_speed"]
    assert "too short: 3 of 4" in recording.missing["rear_wheel_speed"]
    assert "--table gps=FILE" in recording.missing["gnss_speed"]
    assert any(
        (f.message, f.fault, f.count) == ("Wheels", "too short", 7) for f in recording.faults
    )


def test_an_unsorted_log_is_kept_in_its_order_and_read_in_order_of_time(folder):
    lines = drive()
    lines[10], lines[100] = lines[100], lines[10]
    (folder / "drive.log").write_bytes(b"".join(lines))
    recording = bring(folder)
    assert (folder / "run/frames.log").read_bytes() == b"".join(lines)
    assert all(np.all(np.diff(c.time) >= 0) for c in recording.channels.values())
    assert any("not in order of time" in text for text in recording.description["warnings"])


class TestSideTables:
    """Times of tables beside a log."""

    @pytest.fixture
    def with_gps(self, folder):
        """A table that began 0.5 s after the log, on the log's clock."""
        rows = "".join(f"{START * 1e-9 + 0.5 + n * 0.1:.3f},{36 + n}\n" for n in range(10))
        (folder / "gps.csv").write_text("time_s,speed\n" + rows)
        (folder / "roles.toml").write_text(ROLES + GPS_ROLE)
        return folder

    def test_on_the_same_epoch(self, with_gps):
        channel = bring(with_gps, gps="gps.csv").channels["gnss_speed"]
        assert channel.time == pytest.approx(0.5 + np.arange(10) * 0.1, abs=1e-3)
        assert channel.value[0] == pytest.approx(10.0)

    def test_the_recording_is_complete_in_itself(self, with_gps, tmp_path_factory):
        bring(with_gps, gps="gps.csv")
        elsewhere = tmp_path_factory.mktemp("elsewhere") / "moved"
        shutil.move(with_gps / "run", elsewhere)
        shutil.rmtree(with_gps)
        assert run_folder.read(elsewhere).channels["gnss_speed"].value.size == 10

    def test_a_clock_that_does_not_meet_the_log_is_refused(self, with_gps):
        text = "time,speed\n0,36\n1,37\n"
        (with_gps / "gps.csv").write_text(text)
        with pytest.raises(InputError, match="time_offset") as fault:
            bring(with_gps, gps="gps.csv")
        assert 'align = "start"' in str(fault.value)

    def test_a_stated_offset_is_added(self, with_gps):
        (with_gps / "gps.csv").write_text("time,speed\n7,36\n8,37\n")
        rules = '\n[tables.gps]\nalign = "start"\ntime_offset = "-250 ms"\n'
        (with_gps / "roles.toml").write_text(ROLES + GPS_ROLE + rules)
        channel = bring(with_gps, gps="gps.csv").channels["gnss_speed"]
        assert channel.time == pytest.approx([-0.25, 0.75])

    def test_rows_that_are_not_valid_are_no_samples(self, with_gps):
        (with_gps / "gps.csv").write_text("time,speed,valid\n0,36,1\n1,37,0\n2,38,1\n")
        rules = 'valid = "valid"\n\n[tables.gps]\nalign = "start"\n'
        (with_gps / "roles.toml").write_text(ROLES + GPS_ROLE + rules)
        channel = bring(with_gps, gps="gps.csv").channels["gnss_speed"]
        assert channel.time == pytest.approx([0, 2])

    def test_a_table_that_no_role_uses_is_refused(self, with_gps):
        with pytest.raises(InputError, match="no role is bound to the table 'lean'"):
            bring(with_gps, lean="gps.csv")


def test_a_table_may_stand_in_place_of_the_log(folder):
    (folder / "log.csv").write_text("Time (ms),rpm,v (km/h)\n1000,600,36\n1100,,37\n1200,1200,38\n")
    (folder / "roles.toml").write_text(
        'title = "A table"\n[roles.engine_speed]\ncolumn = "rpm"\nunit = "rpm"\n'
        '[roles.vehicle_speed]\ncolumn = "v"\n[roles.gear]\nsignals = ["Engine.Gear"]\n'
    )
    recording = bring(folder, log="log.csv", database=None)
    assert recording.channels["engine_speed"].time == pytest.approx([0, 0.2])
    assert recording.channels["vehicle_speed"].value == pytest.approx([10, 37 / 3.6, 38 / 3.6])
    assert recording.duration == pytest.approx(0.2)
    assert "only tables" in recording.missing["gear"]
    assert recording.frame_count == 0


def test_frames_without_a_database_are_refused(folder):
    with pytest.raises(InputError, match="--dbc"):
        bring(folder, database=None)


def test_a_full_disk_leaves_nothing(folder, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(run_folder, "write_description", full)
    with pytest.raises(InputError, match="No space left"):
        bring(folder)
    assert not (folder / "run").exists()


def test_a_table_without_an_optional_column_lists_the_role_as_missing(folder):
    """As a log without one of the messages does: the other roles are imported."""
    (folder / "t.csv").write_text("time (s),speed (km/h),flag\n0,36,1\n1,37,0\n2,38,1\n")
    (folder / "r.toml").write_text(
        'title = "t"\n[roles.vehicle_speed]\ncolumn = "speed"\nvalid = "flag"\n'
        '[roles.lean_angle]\ncolumn = "lean"\n'
        '[roles.engine_speed]\ncolumn = "speed"\nvalid = "flags"\nunit = "rpm"\n'
    )
    recording = bring(folder, log="t.csv", roles="r.toml", database=None)
    assert recording.channels["vehicle_speed"].value == pytest.approx([36 / 3.6, 38 / 3.6])
    assert "no column 'lean'" in recording.missing["lean_angle"]
    assert "did you mean 'flag'" in recording.missing["engine_speed"]

"""Laws of the run folder: made once, whole in itself, readable when its writer was cut off."""

import os
import shutil

import numpy as np
import pytest

from slipbench.dbc import MOTORBIKE
from slipbench.protocol.codec.codec import Codec, Sender
from slipbench.protocol.codec.messages import Authority, EcuStatus, EngineStatus
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.candump_line import format_line
from slipbench.protocol.recording import run_folder
from slipbench.protocol.recording.database_copy import DATABASE
from slipbench.protocol.recording.run_folder import create, read, write_description

ROLES = MOTORBIKE.with_name("motorbike_roles.toml")


def test_a_folder_is_made_once(tmp_path):
    assert create(tmp_path / "a/b/run").is_dir()
    with pytest.raises(InputError, match="never overwritten"):
        create(tmp_path / "a/b/run")


def test_the_description_may_be_written_again(tmp_path):
    write_description(tmp_path, {"run": {"kind": "trial"}})
    write_description(tmp_path, {"run": {"kind": "trial"}, "lateness": {"p50": 1e-6}})
    assert [item.name for item in tmp_path.iterdir()] == ["run.toml"]


@pytest.mark.parametrize("content", [[], ["notes.txt"]])
def test_what_is_no_recording_is_refused(tmp_path, content):
    for name in content:
        (tmp_path / name).write_text("x")
    with pytest.raises(InputError, match="no recording"):
        read(tmp_path)
    with pytest.raises(InputError, match="check the path"):
        read(tmp_path / "nowhere")


@pytest.fixture
def recording(tmp_path):
    """A recording as a trial leaves it: commands echoed at 100 Hz, the engine at 20 Hz."""
    folder = create(tmp_path / "run")
    shutil.copyfile(MOTORBIKE, folder / "database.dbc")
    shutil.copyfile(ROLES, folder / "roles.toml")
    (folder / "frames.log").write_bytes(b"".join(frames()))
    write_description(folder, {"run": {"kind": "trial"}, "bus": {"bitrate": 1_000_000}})
    return folder


ECU_AHEAD = 1234.5  # s


def frames(seconds=40.0):
    """Status frames whose clock is 20 ppm fast, and wraps at two widths."""
    sender = Sender(Codec(load_database(MOTORBIKE)))
    for n in range(int(seconds * 1000)):
        own = ECU_AHEAD + n * 1e-3 * (1 + 20e-6)
        arrival = n * 1_000_000 + 100_000 + (n * 7919) % 200_000  # ns
        if n % 10 == 0:
            yield line(arrival, sender.encode(EcuStatus(Authority.NONE, 0.25, 0.0, own)))
        if n % 50 == 3:
            yield line(arrival, sender.encode(EngineStatus(400.0 + n * 1e-3, 3, 0.1, own)))


def line(time_ns, frame):
    return format_line(time_ns, "can0", *frame)


def test_messages_of_one_device_share_one_clock(recording):
    """EcuStatus wraps after 16.8 s, EngineStatus after 1.05 s; their times must agree."""
    channels = read(recording).channels
    ecu, engine = channels["throttle_command"], channels["engine_speed"]
    assert {ecu.clock, engine.clock} == {"ecu"}
    leads = [channel.arrival - channel.time for channel in (ecu, engine)]
    assert abs(np.median(leads[0]) - np.median(leads[1])) < 1e-3
    for channel in (ecu, engine):
        rate = np.polyfit(channel.arrival, channel.time, 1)[0]
        assert rate == pytest.approx(1 + 20e-6, abs=3e-6)
        assert np.all(np.diff(channel.time) > 0)


def test_values_are_si(recording):
    channels = read(recording).channels
    assert channels["throttle_command"].value == pytest.approx(0.25)
    assert channels["engine_speed"].value[0] == pytest.approx(400.0, abs=0.05)


def test_a_lost_stretch_is_a_fault_and_times_stay_right(recording):
    path = recording / "frames.log"
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:1000] + lines[1003:3000] + lines[4500:]))
    found = read(recording)
    kinds = {(fault.message, fault.fault) for fault in found.faults}
    assert ("EcuStatus", "lost") in kinds
    channel = found.channels["throttle_command"]
    drift = channel.arrival - channel.time
    assert np.ptp(drift) < 2e-3  # 12 s of frames are gone, and no turn of the clock with them


def test_a_wrong_crc_is_a_fault_and_no_sample(recording):
    path = recording / "frames.log"
    text = bytearray(path.read_bytes())
    mark = text.index(b"#") + 1
    text[mark : mark + 2] = b"00" if text[mark : mark + 2] != b"00" else b"01"
    before = read(recording).channels["throttle_command"].value.size
    path.write_bytes(bytes(text))
    found = read(recording)
    assert found.channels["throttle_command"].value.size == before - 1
    assert any(f.fault == "wrong CRC" and f.count == 1 for f in found.faults)


def test_a_killed_writer_costs_the_torn_line_only(recording):
    path = recording / "frames.log"
    whole = read(recording).frame_count
    path.write_bytes(path.read_bytes()[:-7])
    (recording / "run.toml").unlink()
    found = read(recording)
    assert found.frame_count in (whole - 1, whole)
    assert any("was not completed" in text for text in found.description["warnings"])


def test_a_recording_without_a_frame_still_reads(recording):
    (recording / "frames.log").write_bytes(b"")
    found = read(recording)
    assert found.frame_count == 0
    assert set(found.missing) >= {"throttle_command", "engine_speed", "rear_teeth"}


def test_the_bus_load_is_told_where_the_bit_rate_is_known(recording):
    load = read(recording).bus_load["can0"]
    assert 0.01 < load["mean"] <= load["peak"] < 0.1
    write_description(recording, {"run": {"kind": "trial"}})
    assert not read(recording).bus_load


def test_another_database_is_told(recording):
    write_description(recording, {"run": {"database_sha256": "0" * 64}})
    assert any(
        "has changed since the recording" in text
        for text in read(recording).description["warnings"]
    )


@pytest.mark.parametrize("place", ["../../secret.csv", "/etc/passwd", "tables/../../x.csv"])
def test_a_table_outside_the_folder_is_refused(recording, place):
    write_description(recording, {"tables": {"gps": place}})
    with pytest.raises(InputError, match="leads out of the recording"):
        read(recording)


def test_two_senders_of_one_message_are_told(recording):
    """A second ECU sends the same message 5 ms later, its counter 7 behind."""
    sender = Sender(Codec(load_database(MOTORBIKE)))
    sender.counters["EcuStatus"] = 8
    status = EcuStatus(Authority.NONE, 0.5, 0.0, 0.0)
    second = [line(n * 10_000_000 + 5_000_000, sender.encode(status)) for n in range(4000)]
    path = recording / "frames.log"
    path.write_bytes(path.read_bytes() + b"".join(second))
    found = read(recording)
    assert any(f.message == "EcuStatus" and f.fault == "two senders" for f in found.faults)
    assert "two senders" in found.missing["throttle_command"]
    assert "engine_speed" in found.channels


def test_run_folder_names_are_those_of_the_contract():
    assert (run_folder.FRAMES, DATABASE) == ("frames.log", "database.dbc")


def test_a_folder_that_is_no_recording_is_refused_before_its_tree_is_walked(tmp_path, monkeypatch):
    """A wrong path may name the root of a disk: no more than its own entries are listed."""
    (tmp_path / "deep" / "deeper").mkdir(parents=True)
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    walked = []
    scan = os.scandir
    monkeypatch.setattr(os, "scandir", lambda path=".": walked.append(str(path)) or scan(path))
    with pytest.raises(InputError, match="no recording"):
        read(tmp_path)
    assert not any("deep" in path for path in walked)


@pytest.mark.parametrize("name", ["frames.log", "trial.toml", "run.toml", "notes", "tables"])
def test_a_loop_of_links_is_refused(recording, name):
    """Python 3.11 raises RuntimeError for the target of such a link."""
    path = recording / name
    path.unlink(missing_ok=True)
    other = recording / "other"
    path.symlink_to(other)
    other.symlink_to(path)
    with pytest.raises(InputError, match="to itself"):
        read(recording)


@pytest.mark.parametrize("name", ["frames.log", "database.dbc", "roles.toml", "run.toml"])
def test_a_folder_in_place_of_a_file_is_refused(recording, name):
    (recording / name).unlink()
    (recording / name).mkdir()
    with pytest.raises(InputError, match="this is a folder, not a file"):
        read(recording)


@pytest.mark.parametrize("table", ["run", "bus"])
@pytest.mark.parametrize(
    "start", [10**400, 1 << 63, -(1 << 63), 10**18, -(10**18), 86_401_000_000_000]
)
def test_a_start_that_does_not_belong_to_the_frames_is_refused(recording, table, start):
    """All times count from it: a wrong one gave times of decades, or an overflow."""
    (recording / "run.toml").write_text(f"[{table}]\nstart_time_ns = {start}\n")
    with pytest.raises(InputError, match=f"{table}.start_time_ns does not belong"):
        read(recording)


@pytest.mark.parametrize("start", [0, 100_000, -3_600_000_000_000, 3_600_000_000_000])
def test_a_start_near_the_frames_is_the_time_zero(recording, start):
    write_description(recording, {"run": {"start_time_ns": start}})
    found = read(recording)
    first = found.channels["throttle_command"].arrival[0]
    assert first == pytest.approx((100_000 - start) * 1e-9, abs=1e-3)


@pytest.mark.parametrize("name", ["x" * 300, "a\0b", "file/x"])
def test_a_name_that_no_folder_can_have_is_refused(tmp_path, name):
    (tmp_path / "file").touch()
    with pytest.raises(InputError):
        create(tmp_path / name)
    with pytest.raises(InputError):
        read(tmp_path / name)

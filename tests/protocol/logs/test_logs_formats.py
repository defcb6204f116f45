"""Laws: whatever program wrote a log, its frames are the same, and damage is told."""

import can
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.formats import FORMATS, looks_like

START = 1_700_000_000.0


def messages(count=400, fd=False):
    """Frames of two buses, standard and extended, received and sent, some remote, some errors."""
    draw = np.random.default_rng(7)
    for n in range(count):
        length = int(draw.choice([8, 12, 64] if fd else range(9)))
        extended = bool(draw.integers(2))
        yield can.Message(
            timestamp=START + n * 0.0013,
            channel=int(draw.integers(2)),
            arbitration_id=int(draw.integers(0x1FFFFFFF if extended else 0x7FF)),
            is_extended_id=extended,
            is_fd=fd,
            bitrate_switch=fd,
            is_rx=bool(draw.integers(2)),
            data=draw.bytes(length),
        )


WRITERS = {
    "x.asc": can.ASCWriter,
    "x.blf": can.BLFWriter,
    "x.trc": can.TRCWriter,
    "x.csv": can.CSVWriter,
    "x.log": can.CanutilsLogWriter,
    "x.mf4": can.MF4Writer,
}


def write(path, frames, writer):
    log = writer(str(path))
    for message in frames:
        log.on_message_received(message)
    log.stop()


FD_WRITERS = ("x.asc", "x.blf", "x.log", "x.mf4")  # python-can writes no CAN FD in the others


@pytest.mark.parametrize(
    ("name", "fd"), [(name, False) for name in WRITERS] + [(name, True) for name in FD_WRITERS]
)
def test_every_format_gives_the_same_frames(tmp_path, name, fd):
    path = tmp_path / name
    frames = list(messages(fd=fd))
    write(path, frames, WRITERS[name])
    reading = read_log(path)
    log = reading.frames
    assert not reading.warnings
    assert [log.data[n, : log.length[n]].tobytes() for n in range(len(log))] == [
        bytes(message.data) for message in frames
    ]
    assert log.identifier.tolist() == [message.arbitration_id for message in frames]
    assert log.extended.tolist() == [message.is_extended_id for message in frames]
    assert set(log.fd.tolist()) == {fd}
    if name not in ("x.csv", "x.trc"):  # these do not keep the direction
        assert log.sent.tolist() == [not message.is_rx for message in frames]
    steps = np.diff(log.time_ns) * 1e-9
    assert np.allclose(steps, 0.0013, atol=1.1e-3 if name == "x.trc" else 2e-5)


@pytest.mark.parametrize("name", ["x.asc", "x.blf", "x.mf4", "x.log"])
def test_absolute_time_is_kept(tmp_path, name):
    path = tmp_path / name
    write(path, messages(20), WRITERS[name])
    first = read_log(path).frames.time_ns[0] * 1e-9
    assert first == pytest.approx(START, abs=1.0)


@pytest.mark.parametrize("name", ["x.asc", "x.blf"])
def test_error_and_remote_frames_are_counted(tmp_path, name):
    path = tmp_path / name
    odd = [
        can.Message(timestamp=START, channel=0, is_error_frame=True),
        can.Message(
            timestamp=START,
            channel=0,
            is_remote_frame=True,
            arbitration_id=0x123,
            dlc=4,
            is_extended_id=False,
        ),
    ]
    write(path, [*messages(5), *odd, *messages(5)], WRITERS[name])
    log = read_log(path).frames
    assert len(log) == 10
    assert dict(log.skipped) == {"remote frames": 1, "error frames": 1}


@pytest.fixture(scope="module")
def samples(tmp_path_factory):
    """One small log of each format, as bytes."""
    folder = tmp_path_factory.mktemp("samples")
    for name, writer in WRITERS.items():
        write(folder / name, messages(30), writer)
    return {name: (folder / name).read_bytes() for name in WRITERS}


@pytest.mark.parametrize("name", WRITERS)
@given(data=st.data())
@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_damaged_files_are_read_or_refused(tmp_path, samples, name, data):
    """Cut, changed or joined: a reading or an InputError that names the file."""
    content = bytearray(samples[name])
    cut = data.draw(st.one_of(st.none(), st.integers(0, len(content) - 1)))
    del content[cut:]
    for _ in range(data.draw(st.integers(0, 3))):
        if content:
            at = data.draw(st.integers(0, len(content) - 1))
            content[at : at + data.draw(st.integers(0, 4))] = data.draw(st.binary(max_size=4))
    path = tmp_path / name
    path.write_bytes(bytes(content))
    told = ""
    try:
        assert len(read_log(path).frames) <= 60
    except InputError as fault:
        told = str(fault)
    assert not told or str(path) in told


@pytest.mark.parametrize("name", ["x.asc", "x.trc"])
def test_a_line_of_another_format_is_refused(tmp_path, samples, name):
    path = tmp_path / name
    lines = samples[name].splitlines(keepends=True)
    lines.insert(20, b"(1700000000.000000) can0 123#00\n")
    path.write_bytes(b"".join(lines))
    with pytest.raises(InputError, match=r"line 21") as fault:
        read_log(path)
    assert "candump" in str(fault.value)


def test_relative_times_are_refused(tmp_path, samples):
    """python-can would take each step for a time."""
    path = tmp_path / "x.asc"
    path.write_bytes(samples["x.asc"].replace(b"timestamps absolute", b"timestamps relative"))
    with pytest.raises(InputError, match="absolute"):
        read_log(path)


def test_bus_events_are_counted_and_told(tmp_path, samples):
    path = tmp_path / "x.asc"
    lines = samples["x.asc"].splitlines(keepends=True)
    lines.insert(20, b"   1.234000 1  Statistic: D 10 R 0 XD 0 XR 0 E 0 O 0 B 1.2%\n")
    path.write_bytes(b"".join(lines))
    reading = read_log(path)
    assert len(reading.frames) == 30
    assert any("1 events" in warning and "line 21" in warning for warning in reading.warnings)


def test_a_truncated_blf_keeps_what_is_whole_and_says_so(tmp_path):
    path = tmp_path / "x.blf"
    write(path, messages(20_000), can.BLFWriter)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) * 2 // 3])
    reading = read_log(path)
    assert 1000 < len(reading.frames) < 20_000
    assert any("truncated" in warning for warning in reading.warnings)


HEADS = {
    "busmaster": b"***BUSMASTER Ver 2.4.0***\n***PROTOCOL CAN***\n",
    "crtd": b"166.064000 CXX GVRET-PC Reverse Engineering Tool Output V138\n",
    "carbus": b"@ TEXT @ 2 @ 64 @ 0 @ 55 @ 10078 @ 00:00:10.078 @\r46,016\t1\n",
    "candump-screen": b"  vcan0  123   [8]  11 22 33 44 55 66 77 88\n",
    "motec-ld": b"\x40\x00\x00\x00\x00\x00\x00\x00binary",
    "xrk": b"<hCNF\x00\x10\x00\x00\x00\x01>",
    "compressed": b"\x1f\x8b\x08\x00",
    "matlab": b"MATLAB 5.0 MAT-file",
    "hdf5": b"\x89HDF\r\n\x1a\n",
    "spreadsheet": b"\xd0\xcf\x11\xe0\xa1\xb1",
}


@pytest.mark.parametrize("name", HEADS)
@pytest.mark.parametrize("ending", [".log", ".trc", ".csv", ".asc", ".dat"])
def test_what_no_library_reads_is_named_by_content(tmp_path, name, ending):
    path = tmp_path / f"x{ending}"
    path.write_bytes(HEADS[name])
    assert looks_like(HEADS[name]) == name
    with pytest.raises(InputError) as fault:
        read_log(path)
    assert FORMATS[name].title in str(fault.value)
    assert "remedy" in str(fault.value)


@pytest.mark.parametrize("content", [b"hello\nworld\n", b"\x00\x01\x02\xff" * 50, b"a,b\n1,2\n"])
def test_what_nobody_knows_is_refused(tmp_path, content):
    path = tmp_path / "x.log"
    path.write_bytes(content)
    with pytest.raises(InputError, match="candump text, Vector ASC"):
        read_log(path)


def test_a_missing_file_and_a_folder_are_named(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_log(tmp_path / "nothing.log")
    with pytest.raises(InputError, match="folder"):
        read_log(tmp_path)

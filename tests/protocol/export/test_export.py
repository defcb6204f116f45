"""What is exported is what was recorded, as programs that are not ours read it back."""

import base64
import json

import asammdf
import can
import cantools.database
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from pyarrow import parquet

from slipbench import command
from slipbench.dbc import MOTORBIKE, MOTORBIKE_FD
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.export import ENDINGS, export_run
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.candump_line import format_frames, format_line
from slipbench.protocol.logs.decode import decode, sort_log

START = 1_700_000_000_123_456_000
LENGTHS = [*range(9), 12, 16, 20, 24, 32, 48, 64]


def run_of(folder, lines, database=MOTORBIKE):
    """A run folder with these candump lines."""
    folder.mkdir()
    (folder / "frames.log").write_bytes(b"".join(lines))
    (folder / "database.dbc").write_bytes(database.read_bytes())
    return folder


@st.composite
def recorded_lines(draw):
    """Frames of every kind on two buses, in order of time, to the microsecond."""
    time, lines = START, []
    for _ in range(draw(st.integers(1, 30))):
        time += draw(st.integers(0, 3_000_000)) * 1000
        fd = draw(st.booleans())
        extended = draw(st.booleans())
        size = draw(st.sampled_from(LENGTHS if fd else LENGTHS[:9]))
        lines.append(
            format_line(
                time,
                draw(st.sampled_from(["can0", "can1"])),
                draw(st.integers(0, 0x1FFFFFFF if extended else 0x7FF)),
                draw(st.binary(min_size=size, max_size=size)),
                extended=extended,
                fd_flags=draw(st.integers(0, 3)) if fd else None,
                sent=draw(st.booleans()),
            )
        )
    return lines


def frames_of(path):
    """Every frame of a log: time, bus, identifier, extended, fd, flags, sent, payload."""
    log = read_log(path).frames
    flags = log.fd_flags if log.fd_flags is not None else np.zeros(len(log), np.uint8)
    return [
        (int(t), log.buses[b], int(i), bool(x), bool(f), int(g), bool(s), d[:n].tobytes())
        for t, b, i, x, f, g, s, n, d in zip(
            log.time_ns,
            log.bus,
            log.identifier,
            log.extended,
            log.fd,
            flags,
            log.sent,
            log.length,
            log.data,
            strict=True,
        )
    ]


def as_python_can_reads(messages):
    """The same of python-can's messages, channels as numbers; times are doubles, good for 1 us."""
    return [
        (
            round(m.timestamp * 1e6) * 1000,
            m.channel,
            m.arbitration_id,
            m.is_extended_id,
            m.is_fd,
            m.bitrate_switch + 2 * m.error_state_indicator,
            not m.is_rx,
            bytes(m.data),
        )
        for m in messages
    ]


def numbered(frames, buses, first):
    """Frames with their buses as numbers, as a format counts them."""
    return [(t, buses.index(bus) + first, *rest) for t, bus, *rest in frames]


@pytest.mark.parametrize("form", ["mf4", "blf", "asc"])
@given(lines=recorded_lines())
@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_python_can_reads_back_every_frame_as_it_was_recorded(tmp_path_factory, form, lines):
    run = run_of(tmp_path_factory.mktemp("export") / "run", lines)
    out = export_run(run, form).path
    recorded = frames_of(run / "frames.log")
    buses = read_log(run / "frames.log").frames.buses
    reader = {"mf4": can.MF4Reader, "blf": can.BLFReader}.get(form)
    if reader is None:
        messages = list(can.ASCReader(out, relative_timestamp=False))
    else:
        with reader(out) as opened:
            messages = list(opened)
    read = as_python_can_reads(messages)
    expected = numbered(recorded, buses, 1 if form == "mf4" else 0)
    if form == "mf4":  # read group by group: frames of one instant come in any order
        read, expected = sorted(read), sorted(expected)
    assert read == expected


@given(lines=recorded_lines())
@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_mcap_and_parquet_hold_every_frame_to_the_last_bit(tmp_path_factory, lines):
    run = run_of(tmp_path_factory.mktemp("export") / "run", lines)
    recorded = frames_of(run / "frames.log")
    with export_run(run, "mcap").path.open("rb") as file:
        read = [
            (message.log_time, channel.topic, json.loads(message.data))
            for _, channel, message in make_reader(file).iter_messages(log_time_order=False)
            if channel.topic.endswith("/frames")
        ]
    assert [
        (
            t,
            topic.split("/")[1],
            f["id"],
            f["extended"],
            f["fd"],
            f["fd_flags"],
            f["sent"],
            base64.b64decode(f["data"]),
        )
        for t, topic, f in read
    ] == recorded
    table = parquet.read_table(export_run(run, "parquet").path / "frames.parquet").to_pylist()
    columns = ("time_ns", "bus", "identifier", "extended", "fd", "fd_flags", "sent", "data")
    assert [tuple(row[name] for name in columns) for row in table] == recorded


def random_lines(database, count, seed):
    """Frames of a database's messages with random bits."""
    print("seed", seed)
    random = np.random.default_rng(seed)
    return [
        format_line(
            START + n * 250_000,
            "can0",
            message.identifier,
            random.bytes(message.length),
            extended=message.extended,
            fd_flags=1 if message.fd else None,
        )
        for n in range(count)
        if (message := database.messages[random.integers(len(database.messages))])
    ]


@pytest.fixture(scope="module", params=[MOTORBIKE, MOTORBIKE_FD], ids=["classic", "fd"])
def decoded_run(request, tmp_path_factory):
    """A recording of all messages, and what they decode to by message and signal."""
    database = load_database(request.param)
    folder = tmp_path_factory.mktemp("decoded") / "run"
    run = run_of(folder, random_lines(database, 4000, seed=5), request.param)
    log = read_log(run / "frames.log").frames
    return run, log, decode(sort_log(log, database))


def equal(ours, theirs):
    return np.array_equal(np.asarray(ours, np.float64), np.asarray(theirs, np.float64), True)


def test_asammdf_reads_every_decoded_signal_with_its_time_and_unit(decoded_run):
    run, log, decoded = decoded_run
    with asammdf.MDF(export_run(run, "mf4").path) as mdf:
        known = 0
        for name, signals in decoded.items():
            for signal, samples in signals.items():
                if not samples.rows.size or samples.signal.multiplexer is not None:
                    continue
                read = mdf.get(f"{name}.{signal}")
                same = [other for other in decoded if signal in decoded[other]]
                if len(same) == 1 and signal != "time":  # each group has a time of its own
                    assert equal(mdf.get(signal).samples, read.samples)
                assert equal(samples.value, read.samples), (name, signal)
                assert read.unit == samples.signal.unit
                start = mdf.header.abs_time
                assert np.array_equal(
                    np.round(read.timestamps * 1e9).astype(np.int64) + start,
                    log.time_ns[samples.rows],
                )
                known += samples.rows.size
    assert known > 4000


def test_asammdf_decodes_the_raw_frames_of_an_mf4_itself(decoded_run):
    """Its own bus logging, with the same database, finds the same samples: the frames are right."""
    run, _, decoded = decoded_run
    out = export_run(run, "mf4", run / "again.mf4").path
    with asammdf.MDF(out) as mdf:
        theirs = mdf.extract_bus_logging({"CAN": [(run / "database.dbc", 0)]})
    compared = 0
    for name in ("EngineStatus", "RiderControls"):
        for signal, samples in decoded[name].items():
            found = [theirs.get(signal, group=g, index=i) for g, i in theirs.channels_db[signal]]
            sizes = [each.samples.size for each in found]
            assert samples.rows.size in sizes, (name, signal)
            compared += 1
    assert compared > 4


def test_parquet_and_mcap_hold_every_decoded_signal(decoded_run):
    run, log, decoded = decoded_run
    folder = export_run(run, "parquet", run / "tables").path
    with export_run(run, "mcap", run / "x.mcap").path.open("rb") as file:
        told = {}
        for _, channel, message in make_reader(file).iter_messages(log_time_order=False):
            told.setdefault(channel.topic.split("/")[2], []).append(
                (message.log_time, json.loads(message.data))
            )
    for name, signals in decoded.items():
        if not any(samples.rows.size for samples in signals.values()):
            continue
        table = parquet.read_table(folder / f"{name}.parquet")
        for signal, samples in signals.items():
            column = table[signal].to_numpy(zero_copy_only=False)
            present = np.asarray(table[signal].is_valid())
            assert equal(samples.value, column[present])
            assert table.schema.field(signal).metadata == {b"unit": samples.signal.unit.encode()}
            times = table["time_ns"].to_numpy()[present]
            assert np.array_equal(times, log.time_ns[samples.rows])
            in_mcap = [(t, values[signal]) for t, values in told[name] if signal in values]
            assert [t for t, _ in in_mcap] == times.tolist()
            finite = np.isfinite(np.asarray(samples.value, np.float64))
            assert equal(
                np.asarray(samples.value)[finite],
                [v for (_, v), known in zip(in_mcap, finite, strict=True) if known],
            )


def test_cantools_decodes_what_parquet_says(decoded_run):
    """Through a library that is not ours: one message, frame by frame."""
    run, log, _ = decoded_run
    folder = export_run(run, "parquet", run / "tables2").path
    theirs = cantools.database.load_file(run / "database.dbc").get_message_by_name("EngineStatus")
    table = parquet.read_table(folder / "EngineStatus.parquet").to_pylist()
    rows = np.flatnonzero(log.identifier == theirs.frame_id)
    for row, told in zip(rows, table, strict=True):
        payload = log.data[row, : log.length[row]].tobytes()
        for signal, value in theirs.decode(payload, decode_choices=False).items():
            assert told[signal] == value


def test_nanoseconds_survive_where_the_format_has_them(tmp_path):
    lines = [format_line(START + n * 1_000_007, "can0", n, b"\1") for n in range(500)]
    run = run_of(tmp_path / "run", lines)
    times = read_log(run / "frames.log").frames.time_ns
    with asammdf.MDF(export_run(run, "mf4").path) as mdf:
        read = np.round(mdf.get("CAN_DataFrame").timestamps * 1e9).astype(np.int64)
        assert np.array_equal(read + mdf.header.abs_time, times)
    with can.BLFReader(export_run(run, "blf").path) as reader:
        start = START // 1_000_000 * 1_000_000
        read = [round((m.timestamp - reader.start_timestamp) * 1e9) for m in reader]
    assert np.allclose(np.array(read) + start, times, atol=300)  # python-can adds doubles


def test_a_torn_recording_is_exported_as_far_as_it_goes(tmp_path):
    lines = [format_line(START + n * 1000, "can0", 1, b"\1\2") for n in range(10)]
    run = run_of(tmp_path / "run", [*lines, b"(1700000000.2) can0 12"])
    done = export_run(run, "blf")
    assert done.frames == 10
    assert any("torn" in warning for warning in done.warnings)


@pytest.mark.parametrize("form", sorted(ENDINGS))
def test_nothing_is_overwritten_and_nothing_half_made_is_left(tmp_path, form):
    run = run_of(tmp_path / "run", [format_line(START, "can0", 1, b"\1")])
    done = export_run(run, form)
    with pytest.raises(InputError, match="nothing is overwritten"):
        export_run(run, form)
    (run / "broken").mkdir()
    with pytest.raises(InputError):
        export_run(run / "broken", form)
    assert sorted(path.name for path in run.iterdir()) == sorted(
        ["frames.log", "database.dbc", "broken", done.path.name]
    )


def test_the_command_tells_what_it_wrote_and_which_formats_there_are(tmp_path, monkeypatch, capsys):
    run = run_of(tmp_path / "run", [format_line(START, "can0", 1, b"\1")])
    for form, status in (("mf4", 0), ("xls", 2)):
        monkeypatch.setattr("sys.argv", ["slipbench", "export", str(run), "--format", form])
        with pytest.raises(SystemExit) as end:
            command.main()
        assert (end.value.code or 0) == status
    told = capsys.readouterr()
    assert "1 frames in" in told.out
    assert "mf4, blf, asc, parquet, mcap" in told.err
    assert list(format_frames(read_log(run / "export.mf4").frames))

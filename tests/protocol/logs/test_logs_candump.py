"""Laws: candump text and columns are the same log; what is damaged is told, never guessed."""

import io
import re
from itertools import pairwise

import can
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.candump import TURNS, candump_pieces, parse_pieces
from slipbench.protocol.logs.candump_line import LINE, format_frames, format_line

BUSES = ("can0", "can1", "vcan0", "PCAN_USBBUS1")
FD_LENGTHS = [*range(9), 12, 16, 20, 24, 32, 48, 64]


@st.composite
def frame(draw, resolution=1):
    """One data frame: (time_ns, bus, identifier, extended, fd flags or None, sent, payload)."""
    extended = draw(st.booleans())
    flags = draw(st.one_of(st.none(), st.integers(0, 3)))
    length = draw(st.sampled_from(FD_LENGTHS if flags is not None else FD_LENGTHS[:9]))
    return (
        draw(st.integers(0, 4_000_000_000_000_000_000 // resolution)) * resolution,
        draw(st.sampled_from(BUSES)),
        draw(st.integers(0, 0x1FFFFFFF if extended else 0x7FF)),
        extended,
        flags,
        draw(st.booleans()),
        draw(st.binary(min_size=length, max_size=length)),
    )


def logs(resolution=1):
    """Frames in order of time."""
    frames = st.lists(frame(resolution), min_size=1, max_size=60)
    return frames.map(lambda found: sorted(found, key=lambda one: one[0]))


def text_of(frames):
    return b"".join(
        format_line(t, bus, i, data, extended=e, fd_flags=f, sent=s)
        for t, bus, i, e, f, s, data in frames
    )


def rows_of(log):
    """Frames of a FrameLog as tuples, FD flags aside."""
    return [
        (
            int(log.time_ns[n]),
            log.buses[log.bus[n]],
            int(log.identifier[n]),
            bool(log.extended[n]),
            bool(log.fd[n]),
            bool(log.sent[n]),
            log.data[n, : log.length[n]].tobytes(),
        )
        for n in range(len(log))
    ]


def without_flags(frames):
    return [(t, b, i, e, f is not None, s, d) for t, b, i, e, f, s, d in frames]


def parse(text, warnings=None):
    return parse_pieces([text], "log", [] if warnings is None else warnings)


@given(logs())
def test_frames_survive_text(frames):
    log = parse(text_of(frames))
    assert rows_of(log) == without_flags(frames)
    assert not log.data[np.arange(log.data.shape[1]) >= log.length[:, None]].any()


@given(logs())
def test_columns_write_the_same_text_again(frames):
    kept = [(t, b, i, e, f if f is None else 0, s, d) for t, b, i, e, f, s, d in frames]
    assert b"".join(format_frames(parse(text_of(kept)))) == text_of(kept)


@given(logs(), st.integers(20, 200))
@settings(max_examples=20)
def test_reading_in_pieces_changes_nothing(tmp_path_factory, frames, size):
    path = tmp_path_factory.mktemp("log") / "x.log"
    path.write_bytes(text_of(frames))
    pieces = list(candump_pieces(path, size=size))
    assert b"".join(pieces) == path.read_bytes()
    assert rows_of(parse_pieces(pieces, "log", [])) == without_flags(frames)


@given(logs(resolution=1000))
@settings(max_examples=25)
def test_python_can_reads_what_we_write(tmp_path_factory, frames):
    path = tmp_path_factory.mktemp("log") / "x.log"
    path.write_bytes(text_of(frames))
    messages = list(can.CanutilsLogReader(path))
    assert len(messages) == len(frames)
    for message, (time_ns, bus, identifier, extended, flags, sent, data) in zip(
        messages, frames, strict=True
    ):
        assert message.timestamp == pytest.approx(time_ns * 1e-9, abs=1e-6)
        assert (message.channel, message.arbitration_id) == (bus, identifier)
        assert (message.is_extended_id, bytes(message.data)) == (extended, data)
        assert (message.is_fd, message.is_rx) == (flags is not None, not sent)


@given(logs(resolution=1000))
@settings(max_examples=25)
def test_we_read_what_python_can_writes(frames):
    file = io.StringIO()
    writer = can.CanutilsLogWriter(file)
    for time_ns, bus, identifier, extended, flags, sent, data in frames:
        writer.on_message_received(
            can.Message(
                timestamp=time_ns * 1e-9,
                channel=bus,
                arbitration_id=identifier,
                is_extended_id=extended,
                is_fd=flags is not None,
                is_rx=not sent,
                data=data,
                bitrate_switch=bool(flags and flags & 1),
                error_state_indicator=bool(flags and flags & 2),
            )
        )
    log = parse(file.getvalue().encode())
    assert [row[1:] for row in rows_of(log)] == [row[1:] for row in without_flags(frames)]


LINES = st.one_of(
    frame().map(lambda one: text_of([one])[:-1]),
    st.sampled_from(
        [
            b"",
            b"   ",
            b"# a comment",
            b"(1.5) can0 123#R",
            b"(1.5) can0 123#R8 T",
            b"(1.000001) can0 20000088#0000000000000000",
            b"(2.25) can0  7FF#  R",
            b"(2.250000) can0 123#0011223344556677_9",
            b"(3.1) can0 12345678##0",
        ]
    ),
    st.text("()#0123456789ABCDEFRT. can", max_size=40).map(str.encode),
)


@given(st.lists(LINES, max_size=40))
@settings(max_examples=120)
def test_many_lines_at_once_is_line_by_line(lines):
    """The columnar reader takes a text exactly if the definition of a line takes each line."""
    readable = [
        not line.strip() or line.startswith(b"#") or LINE.fullmatch(line) is not None
        for line in lines
    ]
    text = b"".join(line + b"\n" for line in lines)
    if all(readable):
        log = parse(text)
        assert len(log) + sum(count for _, count in log.skipped) == sum(
            bool(line.strip()) for line in lines
        )
    else:
        with pytest.raises(InputError, match=f"line {readable.index(False) + 1}\\b"):
            parse(text)


@given(logs(), st.data())
@settings(max_examples=80)
def test_damage_is_read_or_refused(frames, data):
    """Bytes changed, dropped or doubled: frames or an InputError, nothing else."""
    text = bytearray(text_of(frames))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text) - 1))
        text[at : at + data.draw(st.integers(0, 5))] = data.draw(st.binary(max_size=5))
        if not text:
            break
    try:
        read = len(parse(bytes(text)))
    except InputError:
        return
    assert read <= len(frames) + 20


@given(logs(), st.data())
def test_a_torn_end_costs_one_line_and_is_told(frames, data):
    text = text_of(frames)
    torn = text[: data.draw(st.integers(0, len(text) - 1))]
    whole = torn.count(b"\n")
    warnings = []
    if whole == 0 and torn and LINE.fullmatch(torn) is None:
        with pytest.raises(InputError):
            parse(torn, warnings)
        return
    log = parse(torn, warnings)
    assert len(log) in (whole, whole + 1)
    assert rows_of(log)[:whole] == without_flags(frames)[:whole]
    assert bool(warnings) == (not torn.endswith(b"\n") and bool(torn))


def test_zeros_after_a_power_cut_are_a_torn_end():
    text = text_of([(1000, "can0", 1, False, None, False, b"ab")] * 3)
    warnings = []
    assert len(parse(text + b"\0" * 512, warnings)) == 3
    warnings = []
    assert len(parse(text + b"(0.00" + b"\0" * 512, warnings)) == 3
    assert "is incomplete" in warnings[0]


def buses_in_turn(frames):
    """Whether each bus is in order, and no step back between two is longer than their turns."""
    each = ([f[0] for f in frames if f[1] == bus] for bus in {f[1] for f in frames})
    steps = [a[0] - b[0] for a, b in pairwise(frames)]
    return all(stamps == sorted(stamps) for stamps in each) and max(steps) <= TURNS


@given(st.lists(frame(), min_size=2, max_size=60))
def test_frames_out_of_order_are_sorted_and_told(frames):
    warnings = []
    log = parse(text_of(frames), warnings)
    assert rows_of(log) == without_flags(sorted(frames, key=lambda one: one[0]))
    back = sum(b[0] < a[0] for a, b in pairwise(frames))
    told = back > 0 and not buses_in_turn(frames)
    assert len(warnings) == told
    if told:
        assert f"{back} steps back" in warnings[0]


def test_frames_of_one_instant_stay_in_their_order():
    frames = [(5, "can0", n % 7, False, None, False, bytes([n])) for n in range(100)]
    assert rows_of(parse(text_of(frames))) == without_flags(frames)


@pytest.mark.parametrize(
    ("line", "hint"),
    [
        ("   1.234 1  123  Rx   d 2 01 02", "Vector ASC"),
        ("     1)         1.9  Rx         0076  8  3E 80", "PCAN trace"),
        ("22:20:14:992 Rx 0 0000021A s 8 FE 36", "BUSMASTER"),
        ("166.064000 R11 0000021A FE 36", "CRTD"),
        ("  vcan0  123   [2]  11 22", "screen output"),
        ("garbage", ""),
        ("(1.0) can0 8FF#00", ""),  # a standard identifier ends at 7FF
        ("(1.0) can0 123#001", ""),  # half a byte
        ("(1.0) can0 123#112233445566778899", ""),  # nine bytes
        ("(99999999999.0) can0 123#00", ""),
        ("(9999999999.0) can0 123#00", ""),  # beyond 64 bits of ns
    ],
)
def test_a_foreign_line_is_named(tmp_path, line, hint):
    path = tmp_path / "drive.log"
    good = "(0.5) can0 123#00\n"
    path.write_text(good * 4 + line + "\n" + good)
    with pytest.raises(InputError) as fault:
        read_log(path)
    message = str(fault.value)
    assert f"{path}: line 5" in message
    assert line.strip()[:30] in message
    assert hint in message
    assert "remedy" in message


def test_remote_and_error_frames_are_counted_apart(tmp_path):
    path = tmp_path / "x.log"
    path.write_text(
        "(1.0) can0 123#R\n(1.1) can0 123#00\n(1.2) can0 20000080#00\n# hello\n(1.3) can0 1#R8\n".replace(
            "can0 1#", "can0 001#"
        )
    )
    log = read_log(path).frames
    assert len(log) == 1
    assert dict(log.skipped) == {"remote frames": 2, "error frames": 1, "comments": 1}


def test_windows_line_ends_and_small_letters_are_read():
    log = parse(b"(1.5) can0 1ab#deadBEEF\r\n(1.5) can0 1AB#DEADBEEF\n")
    assert rows_of(log)[0] == rows_of(log)[1]


@pytest.mark.parametrize("content", [b"", b"\n\n  \n", b"\0" * 100])
def test_an_empty_file_is_refused(tmp_path, content):
    path = tmp_path / "empty.log"
    path.write_bytes(content)
    with pytest.raises(InputError, match=re.escape(str(path))):
        read_log(path)


def test_a_log_without_data_frames_is_refused(tmp_path):
    path = tmp_path / "x.log"
    path.write_text("(1.0) can0 20000080#00\n(1.0) can0 20000080#00\n")
    with pytest.raises(InputError, match="2 error frames"):
        read_log(path)


@pytest.mark.parametrize("size", [7, 40, 45, 90, 8_000_000])
def test_a_torn_last_line_is_left_out_wherever_the_file_is_cut_into_pieces(tmp_path, size):
    lines = [format_line(n * 1_000_000, "can0", n, bytes(2)) for n in range(9)]
    torn = format_line(9_000_000, "can0", 9, bytes(2))
    path = tmp_path / "x.log"
    for cut in range(1, len(torn) - 1):
        path.write_bytes(b"".join(lines) + torn[:cut])
        warnings = []
        log = parse_pieces(candump_pieces(path, size=size), "x.log", warnings)
        assert len(log) in (9, 10)  # a cut within the payload can leave a shorter frame
        assert log.identifier.tolist()[:9] == list(range(9))
        assert len(warnings) == (1 if torn[:cut].strip() else 0)

"""Laws: the whole-log decode is cantools' decode, bit for bit, whatever the database."""

import struct

import cantools.database
import numpy as np
import pytest
from cantools.database.can import Message, Signal
from cantools.database.conversion import BaseConversion
from cantools.database.errors import DecodeError
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.dbc import MOTORBIKE
from slipbench.protocol.database.database import describe, load_database
from slipbench.protocol.database.layout import Database
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.decode import decode, sort_log
from slipbench.protocol.logs.frame_log import FrameLog
from tests.recordings import recording

LENGTHS = [*range(1, 9), 12, 16, 20, 24, 32, 48, 64]
SCALES = st.sampled_from([1, 2, 3, -1, 1000, 0.5, 0.01, 0.1, -0.25, 0.390625, 1 / 3, 7.0, 1e-7])
OFFSETS = st.sampled_from([0, 1, -40, 0.5, -67.67, 1e6, 273.15, -(2**40)])


def log_of(frames, width=64):
    """Frames as (identifier, extended, payload), one per microsecond."""
    data = np.zeros((len(frames), width), np.uint8)
    for row, (_, _, payload) in enumerate(frames):
        data[row, : len(payload)] = list(payload)
    n = len(frames)
    return FrameLog(
        np.arange(n, dtype=np.int64) * 1000,
        np.zeros(n, np.uint8),
        np.array([identifier for identifier, _, _ in frames], np.uint32),
        np.array([extended for _, extended, _ in frames], np.bool_),
        np.array([len(payload) > 8 for *_, payload in frames], np.bool_),
        np.zeros(n, np.bool_),
        np.array([len(payload) for *_, payload in frames], np.uint8),
        data,
        ("can0",),
    )


def network_to_start(bit, length, little_endian):
    """DBC start bit of a signal that begins at `bit` in its own byte order's count."""
    return bit if little_endian else 8 * (bit // 8) + 7 - bit % 8


@st.composite
def signals(draw, name, first, room, little_endian, **multiplexing):
    """One signal somewhere within `room` bits from `first` (in its byte order's count)."""
    is_float = draw(st.booleans()) and room >= 16
    if is_float:
        length = draw(st.sampled_from([bits for bits in (16, 32, 64) if bits <= room]))
    else:
        length = draw(st.integers(1, min(64, room)))
    start = first + draw(st.integers(0, room - length))
    return Signal(
        name,
        network_to_start(start, length, little_endian),
        length,
        "little_endian" if little_endian else "big_endian",
        is_signed=draw(st.booleans()) and not is_float,
        conversion=BaseConversion.factory(
            scale=draw(SCALES),
            offset=draw(OFFSETS),
            is_float=is_float,
            choices=draw(st.sampled_from([None, {0: "off", 1: "on"}])) if not is_float else None,
        ),
        **multiplexing,
    ), start + length


@st.composite
def plain(draw, length, first_bit=0, prefix="s", **multiplexing):
    """Signals of one byte order each in its own stretch of whole bytes; none overlap."""
    found, byte = [], first_bit // 8
    while byte < length and len(found) < 6:
        size = draw(st.integers(1, min(16, length - byte)))
        little = draw(st.booleans())
        at, end = 8 * byte, 8 * (byte + size)
        while at < end and draw(st.booleans()):
            name = f"{prefix}{len(found)}"
            signal, at = draw(signals(name, at, end - at, little, **multiplexing))
            found.append(signal)
        byte += size
    return found


@st.composite
def messages(draw):
    """A message: plain, multiplexed, or multiplexed twice over."""
    length = draw(st.sampled_from(LENGTHS))
    depth = draw(st.integers(0, 2)) if length >= 4 else 0
    found, parent = [], {}
    for level in range(depth):
        multiplexer = f"mux{level}"
        found.append(
            Signal(multiplexer, 8 * level, 3, is_multiplexer=True, is_signed=False, **parent)
        )
        for ids in ([0, 2], [1], [3, 4, 5]):
            branch = {"multiplexer_ids": ids, "multiplexer_signal": multiplexer}
            if level + 1 < depth and ids == [0, 2]:
                parent = branch
                continue
            prefix = f"l{level}m{ids[0]}_"
            found += draw(plain(length, 8 * (level + 1), prefix, **branch))
    found += [] if depth else draw(plain(length))
    extended = draw(st.booleans())
    identifier = draw(st.integers(0, 0x1FFFFFFF if extended else 0x7FF))
    return Message(
        identifier, "M", length, found, is_extended_frame=extended, is_fd=length > 8, strict=True
    )


def both_ways(message, path):
    """A message as cantools and as we read it, through a DBC where that can express it."""
    if any(signal.is_float and signal.length == 16 for signal in message.signals):
        return message, Database("random", "", (describe(message),))
    text = cantools.database.Database(messages=[message], version="").as_dbc_string()
    path.write_text(text, encoding="utf-8")
    return cantools.database.load_string(text, "dbc").messages[0], load_database(path)


def payloads(length):
    return st.lists(st.binary(min_size=length, max_size=64), min_size=1, max_size=6)


def same(ours, theirs):
    """Equal to the last bit, whatever the type in which it is held."""
    if isinstance(theirs, float):
        if np.isnan(theirs):
            return np.isnan(ours)
        return struct.pack("<d", ours) == struct.pack("<d", theirs)
    if isinstance(ours, np.floating):
        return float(ours) == float(theirs)  # beyond 64 bits: the nearest double
    return int(ours) == theirs


@settings(max_examples=250, deadline=None)
@given(message=messages(), data=st.data())
def test_every_sample_is_what_cantools_decodes(tmp_path_factory, message, data):
    theirs, database = both_ways(message, tmp_path_factory.getbasetemp() / "random.dbc")
    sent = data.draw(payloads(message.length))
    log = log_of([(message.frame_id, message.is_extended_frame, payload) for payload in sent])
    decoded = decode(sort_log(log, database))["M"]
    for row, payload in enumerate(sent):
        try:
            expected = theirs.decode(payload, decode_choices=False)
            raw = theirs.decode(payload, decode_choices=False, scaling=False)
        except DecodeError:
            continue
        present = {name: samples for name, samples in decoded.items() if row in samples.rows}
        assert present.keys() == expected.keys()
        for name, samples in present.items():
            at = int(np.searchsorted(samples.rows, row))
            assert same(samples.raw[at], raw[name]), name
            assert same(samples.value[at], expected[name]), name


KNOWN = load_database(MOTORBIKE)


@given(
    st.lists(
        st.tuples(
            st.sampled_from([m.identifier for m in KNOWN.messages]) | st.integers(0, 0x7FF),
            st.booleans(),
            st.binary(max_size=8),
        ),
        max_size=40,
    )
)
def test_every_frame_is_kept_once_decoded_short_or_unknown(frames):
    ordered = sort_log(log_of(frames, width=8), KNOWN)
    rows = [each.rows for each in ordered.frames.values()]
    kept = np.concatenate([*rows, *ordered.short.values(), ordered.unknown])
    assert sorted(kept.tolist()) == list(range(len(frames)))
    assert sum(ordered.unknown_identifiers().values()) == ordered.unknown.size
    for name, short in ordered.short.items():
        assert (ordered.log.length[short] < KNOWN.message(name).length).all()


def test_a_log_without_frames_decodes_to_nothing():
    decoded = decode(sort_log(log_of([], width=8), KNOWN))
    assert all(s.value.size == 0 for message in decoded.values() for s in message.values())


def test_a_short_log_of_a_long_message_is_short_not_wrong(tmp_path):
    path = tmp_path / "long.dbc"
    path.write_text('BO_ 5 M: 16 A\n SG_ s : 64|8@1+ (1,0) [0|0] "" A\n', encoding="utf-8")
    ordered = sort_log(log_of([(5, False, bytes(8))], width=8), load_database(path))
    assert ordered.short["M"].tolist() == [0]
    assert ordered.frames["M"].samples("s").value.size == 0


@pytest.mark.parametrize(
    "name", ["yamaha_r1/session.dbc", "subaru_wrx/sample_can_spec.dbc", "comma2k19/segment.dbc"]
)
def test_real_databases_decode_as_cantools_does(name):
    path = recording(name)
    theirs = cantools.database.load_file(path)
    random = np.random.default_rng(1)
    frames = [
        (message.frame_id, message.is_extended_frame, random.bytes(8))
        for message in theirs.messages
        for _ in range(50)
    ]
    decoded = decode(sort_log(log_of(frames, width=8), load_database(path)))
    for message in theirs.messages:
        for signal in decoded[message.name].values():
            for row, ours in zip(signal.rows, signal.value, strict=True):
                expected = message.decode(frames[row][2], decode_choices=False)
                assert same(ours, expected[signal.signal.name])


@pytest.mark.parametrize(
    ("log", "database"),
    [
        ("yamaha_r1/session.log", "yamaha_r1/session.dbc"),
        ("subaru_wrx/can_sample.log", "subaru_wrx/sample_can_spec.dbc"),
        ("gt86_gt350/gt350_vsslog.trc", "gt86_gt350/ford_lincoln_base_pt.dbc"),
        ("comma2k19/segment.log", "comma2k19/segment.dbc"),
    ],
)
def test_logs_of_real_vehicles_decode_as_cantools_does(log, database):
    frames = read_log(recording(log)).frames
    ordered = sort_log(frames, load_database(recording(database)))
    decoded = decode(ordered)
    for message in cantools.database.load_file(recording(database)).messages:
        for row in ordered.frames[message.name].rows[::100]:
            payload = frames.data[row, : frames.length[row]].tobytes()
            expected = message.decode(payload, decode_choices=False)
            for name, value in expected.items():
                samples = decoded[message.name][name]
                assert same(samples.value[np.searchsorted(samples.rows, row)], value)

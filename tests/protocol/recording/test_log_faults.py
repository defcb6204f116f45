"""Laws: what is done to a log is what its faults say, and no more."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.dbc import MOTORBIKE
from slipbench.protocol.codec import e2e
from slipbench.protocol.codec.codec import Codec, Sender
from slipbench.protocol.codec.messages import Authority, EcuStatus
from slipbench.protocol.database.database import load_database
from slipbench.protocol.logs.decode import sort_log
from slipbench.protocol.logs.frame_log import FrameLog
from slipbench.protocol.recording.log_faults import log_faults
from tests.protocol.logs.test_decode import log_of

DATABASE = load_database(MOTORBIKE)
ECU = DATABASE.message("EcuStatus")


def drive(n=100):
    """Frames of the ECU, one a microsecond."""
    sender = Sender(Codec(DATABASE))
    frames = [sender.encode(EcuStatus(Authority.BOTH, 0.5, 0.1, i * 1e-3)) for i in range(n)]
    return [(identifier, False, payload) for identifier, payload in frames]


def found(frames, spacing=1.0):
    log = log_of(frames, width=8)
    log = FrameLog(**{**vars(log), "time_ns": (log.time_ns * spacing).astype(np.int64)})
    return {(f.message, f.fault): f for f in log_faults(sort_log(log, DATABASE))}


def test_a_sound_log_has_no_fault():
    assert not found(drive())
    assert not found([])


@given(st.sets(st.integers(1, 98), min_size=1, max_size=10))
def test_lost_frames_are_counted_where_they_are_missing(lost):
    faults = found([frame for i, frame in enumerate(drive()) if i not in lost])
    assert faults.keys() == {("EcuStatus", "lost")}
    assert faults["EcuStatus", "lost"].count == len(lost)


@given(st.sets(st.integers(0, 99), min_size=1, max_size=10))
def test_repeated_frames_are_counted(again):
    faults = found(
        [each for i, frame in enumerate(drive()) for each in [frame] * (1 + (i in again))]
    )
    assert faults.keys() == {("EcuStatus", "repeated")}
    assert faults["EcuStatus", "repeated"].count == len(again)


@given(st.sets(st.integers(1, 98), min_size=1, max_size=10), st.integers(0, 63))
def test_a_wrong_bit_is_a_wrong_crc_and_a_lost_frame(wrong, bit):
    frames = drive()
    for row in wrong:
        payload = bytearray(frames[row][2])
        payload[bit // 8] ^= 1 << bit % 8
        frames[row] = (*frames[row][:2], bytes(payload))
    faults = found(frames)
    assert faults["EcuStatus", "wrong CRC"].count == len(wrong)
    assert faults["EcuStatus", "lost"].count == len(wrong)
    assert faults["EcuStatus", "wrong CRC"].first_time == pytest.approx(min(wrong) * 1e-6)


@given(st.sets(st.integers(1, 98), min_size=1, max_size=10), st.integers(0, 7))
def test_short_and_unknown_frames_are_counted_and_kept(rows, length):
    frames = drive()
    for row in rows:
        frames[row] = (frames[row][0], False, frames[row][2][:length])
    frames += [(0x7FF, False, b"")] * 3 + [(ECU.identifier, True, b"12345678")] * 2
    faults = found(frames)
    assert faults["EcuStatus", "too short"].count == len(rows)
    assert faults["0x7ff", "unknown identifier"].count == 3
    assert faults["0x20", "unknown identifier"].count == 2


def test_silence_of_a_cyclic_message_is_stale():
    assert not found(drive(), spacing=9_900)
    assert found(drive(), spacing=10_100)["EcuStatus", "stale"].count == 99


def test_a_value_outside_its_range_is_told_though_the_frame_is_sound():
    payload = bytearray(8)
    payload[1:8] = (0x3FFF << 6).to_bytes(7, "little")  # throttle_command 163.83 %
    e2e.protect(payload, ECU.protection.data_id, 0)
    assert found([(ECU.identifier, False, bytes(payload))]).keys() == {
        ("EcuStatus", "out of range")
    }

"""One frame's bits: as a log counts them, and where it differs from the usual, as they are sent."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from slipbench.protocol.codec.bit_stuffing import classic_bits, fd_bits
from slipbench.protocol.codec.frame_bits import frame_bits
from slipbench.protocol.logs.frame_log import FrameLog
from tests.protocol.codec.test_bus_load import (
    DLC,
    crc15,
    frames,
    identifier_bits,
    number,
    payload_bits,
    stuffed,
)
from tests.protocol.logs.test_decode import LENGTHS, log_of


@given(frames(range(9)))
def test_one_classic_frame_is_counted_as_in_a_log(frame):
    assert classic_bits(*frame) == frame_bits(log_of([frame], width=8)).nominal[0]


@given(frames([0, *LENGTHS]))
def test_one_fd_frame_is_counted_as_in_a_log(frame):
    log = log_of([frame])
    bits = frame_bits(FrameLog(**{**vars(log), "fd": np.ones(1, np.bool_)}))
    assert fd_bits(*frame) == (bits.nominal[0], bits.data[0])


@given(frames([0]), st.integers(0, 8))
def test_a_remote_frame_carries_a_length_and_no_data(frame, requested):
    identifier, extended, _ = frame
    control = [1, 0, 0, *number(requested, 4)]  # RTR
    bits = [*identifier_bits(identifier, extended), *control]
    assert (
        classic_bits(identifier, extended, b"", requested)
        == len(stuffed([*bits, *crc15(bits)])) + 13
    )


@given(frames([0, *LENGTHS]), st.booleans(), st.booleans())
def test_the_flags_of_an_fd_frame_are_bits_like_any_other(frame, switches_rate, error_passive):
    identifier, extended, payload = frame
    flags = [0, 1, 0, switches_rate] if extended else [0, 0, 1, 0, switches_rate]
    slow = [*identifier_bits(identifier, extended), *flags]
    bits = [*slow, error_passive, *number(DLC[len(payload)], 4), *payload_bits(payload)]
    sent = stuffed(bits)
    due_at_the_end = len(sent) > len(stuffed(bits[:-1])) + 1
    fixed = 4 + (17 + 6 if len(payload) <= 16 else 21 + 7)
    told = fd_bits(identifier, extended, payload, switches_rate, error_passive)
    assert sum(told) == len(sent) - due_at_the_end + fixed + 13
    assert told[0] == (len(stuffed(slow)) + 13 if switches_rate else sum(told))
